from __future__ import annotations

import re

import pytest

from palpate.analysis.monitoring.app import Access, access_for, make_app
from palpate.analysis.monitoring.watching import MonitorError, Watch
from tests.analysis.monitoring.people_for_tests import run
from tests.studies.labs import Lab

pytestmark = pytest.mark.needs("flask")

TOKEN = "a-token-of-good-length"
HERE = Access(loopback=True, token=None)
NASTY = "<script>alert('note')</script>"


@pytest.fixture
def lab(tmp_path):
    return Lab(tmp_path)


def client(lab, access=HERE):
    return make_app(Watch(lab.path), access).test_client()


def text_of(answer):
    return answer.get_data(as_text=True)


@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH", "DELETE", "OPTIONS", "TRACE"])
@pytest.mark.parametrize("path", ["/", "/fragment", "/anything"])
def test_nothing_but_reading_is_allowed(lab, method, path):
    answer = client(lab).open(path, method=method)
    assert (answer.status_code, answer.headers["Allow"]) == (405, "GET, HEAD")


def test_the_page_may_run_only_its_own_script_and_load_nothing(lab):
    run(lab)
    answer = client(lab).get("/")
    policy, page = answer.headers["Content-Security-Policy"], text_of(answer)
    (nonce,) = set(re.findall(r"'nonce-([^']+)'", policy))
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert page.count(f'nonce="{nonce}"') == 2 == len(re.findall(r"<(?:script|style)\b", page))
    assert not re.findall(r"""(?:src|href|url)\s*[=(]\s*["']?(?:https?:)?//""", page)
    assert " style=" not in page
    assert "onclick" not in page
    assert answer.headers["Cache-Control"] == "no-store"
    assert client(lab).get("/").headers["Content-Security-Policy"] != policy


def test_whatever_somebody_typed_is_shown_and_never_run(lab):
    run(lab, asides=[(2, {"do": "note", "text": NASTY})], changes={"title": f"Title {NASTY}"})
    page = text_of(client(lab).get("/"))
    assert NASTY not in page
    assert page.count("&lt;script&gt;alert(&#39;note&#39;)&lt;/script&gt;") == 3  # a note, and two headings


def test_an_unchanged_fragment_is_not_sent_again(lab):
    run(lab)
    browser = client(lab)
    first = browser.get("/fragment")
    again = browser.get("/fragment", headers={"If-None-Match": first.headers["ETag"]})
    run(lab, "P002", 1)
    after = browser.get("/fragment", headers={"If-None-Match": first.headers["ETag"]})
    assert (first.status_code, again.status_code, after.status_code) == (200, 304, 200)
    assert again.data == b""
    assert "P002" in text_of(after)


def test_head_answers_as_get_without_a_body(lab):
    answer = client(lab).head("/")
    assert (answer.status_code, answer.data) == (200, b"")


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8321", "127.0.0.1.evil.example", "[2001:db8::1]:8321"])
def test_a_page_that_was_rebound_to_this_machine_gets_nothing(lab, host):
    run(lab)
    answer = client(lab).get("/", headers={"Host": host})
    assert answer.status_code == 403
    assert "P001" not in text_of(answer)


@pytest.mark.parametrize("host", ["127.0.0.1:8321", "localhost", "localhost:9000", "[::1]:8321", "LOCALHOST:1"])
def test_this_machines_own_names_are_answered(lab, host):
    assert client(lab).get("/", headers={"Host": host}).status_code == 200


@pytest.fixture
def guarded(lab):
    run(lab)
    return client(lab, Access(loopback=False, token=TOKEN))


@pytest.mark.parametrize(
    "path", ["/", "/fragment", "/?token=", f"/?token={TOKEN}x", f"/?token={TOKEN[:-1]}", "/?token=ü"]
)
def test_without_the_token_nothing_is_shown(guarded, path):
    answer = guarded.get(path, headers={"Authorization": f"Basic {TOKEN}"})
    assert (answer.status_code, answer.headers["WWW-Authenticate"]) == (401, "Bearer")
    assert "P001" not in text_of(answer)
    assert "Set-Cookie" not in answer.headers


def test_the_token_in_the_address_is_traded_for_a_cookie_that_no_script_reads(guarded):
    answer = guarded.get(f"/?token={TOKEN}")
    cookie = answer.headers["Set-Cookie"]
    assert (answer.status_code, answer.headers["Location"]) == (302, "/")
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= set(cookie.split("; "))
    assert TOKEN not in cookie
    assert "P001" in text_of(guarded.get("/"))
    assert guarded.get("/fragment").status_code == 200


def test_the_token_as_a_bearer_is_let_in(guarded):
    assert guarded.get("/fragment", headers={"Authorization": f"Bearer {TOKEN}"}).status_code == 200


def test_a_cookie_of_another_token_is_worth_nothing(lab, guarded):
    other = Access(loopback=False, token=TOKEN[::-1])
    guarded.set_cookie(Access(False, TOKEN).cookie, other.cookie_value)
    assert guarded.get("/").status_code == 401


def test_beyond_this_machine_a_token_is_made_and_two_are_never_alike():
    assert access_for("127.0.0.1", None) == HERE
    assert access_for("::1", None).loopback
    accesses = access_for("0.0.0.0", None), access_for("192.168.1.5", None)
    assert not any(access.loopback for access in accesses)
    assert len({access.token for access in accesses}) == 2
    assert min(len(access.token) for access in accesses) >= 16


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
def test_a_short_token_is_refused(host):
    with pytest.raises(MonitorError, match="7 characters, at least 16 are expected"):
        access_for(host, "too-few")


def test_a_lab_that_goes_away_is_reported_in_the_page(lab, tmp_path):
    browser = make_app(Watch(tmp_path / "gone"), HERE).test_client()
    answer = browser.get("/")
    assert answer.status_code == 503
    assert "no such folder" in text_of(answer)


def test_the_page_names_what_it_shows_for_those_who_do_not_see_it(lab):
    run(lab)
    run(lab, "P002", 1, stop_before=2)
    page = text_of(client(lab).get("/"))
    assert page.count("<h1") == 1
    assert '<html lang="en">' in page
    assert all("aria-label=" in svg for svg in re.findall(r"<svg[^>]*>", page))
    assert all('scope="' in head for head in re.findall(r"<th\b[^>]*>", page))
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
