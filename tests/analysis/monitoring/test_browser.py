from __future__ import annotations

import subprocess
import sys
from contextlib import contextmanager

import pytest

from tests.analysis.monitoring.browser import PATIENCE_S, chromium, emulate, monitoring, until
from tests.analysis.monitoring.people_for_tests import run, straight
from tests.studies.labs import Lab

pytestmark = pytest.mark.needs("selenium", "chromium")

REPEATED = {"order": {"design": "williams", "repeats": 2}}
CONTRAST = """
const channel = (c) => (c /= 255) <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
const numbers = (text) => text.match(/[\\d.]+/g).map(Number);
const luminance = ([r, g, b]) => 0.2126 * channel(r) + 0.7152 * channel(g) + 0.0722 * channel(b);
const ground = (element) => {
  for (let each = element; each; each = each.parentElement) {
    const [r, g, b, a] = numbers(getComputedStyle(each).backgroundColor);
    if (a === undefined || a > 0) return [r, g, b];
  }
  return [255, 255, 255];
};
return [...document.querySelectorAll("main *, footer")]
  .filter((each) => [...each.childNodes].some((n) => n.nodeType === 3 && n.nodeValue.trim()) && !each.closest("svg")
    && each.getClientRects().length)
  .map((each) => {
    const [a, b] = [luminance(numbers(getComputedStyle(each).color)), luminance(ground(each))].sort((x, y) => y - x);
    return [(a + 0.05) / (b + 0.05), each.className, each.textContent.trim().slice(0, 40)];
  })
  .filter(([ratio]) => ratio < 4.5);
"""


@pytest.fixture(scope="module")
def started(tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("profile")) as one:
        yield one


@pytest.fixture
def browser(started):
    """The browser without the page, and the complaints, of the test before, whose monitor is gone."""
    started.get("about:blank")
    started.get_log("browser")
    return started


@pytest.fixture
def lab(tmp_path):
    built = Lab(tmp_path)
    run(built, "P001", 0, changes=REPEATED)
    run(built, "P002", 1, changes=REPEATED, change=straight(2.0), asides=[(3, {"do": "note", "text": "<b>bold</b>"})])
    return built


@contextmanager
def another_process_runs(lab, participant):
    """A session that waits at every question until its gate is opened."""
    (lab.path / "gate").mkdir()
    command = [sys.executable, "-m", "tests.analysis.monitoring.gated_session", str(lab.path), participant]
    with subprocess.Popen(command) as process:
        try:
            yield process
        finally:
            process.kill()


def one(browser, selector):
    from selenium.webdriver.common.by import By

    return browser.find_element(By.CSS_SELECTOR, selector)


def row(browser, participant):
    return browser.execute_script(
        "const rows = [...document.querySelectorAll('table.sessions tr')];"
        "const row = rows.find((each) => each.textContent.includes(arguments[0]));"
        "return row ? row.textContent.replace(/\\s+/g, ' ') : ''",
        participant,
    )


def complaints(browser):
    return [entry for entry in browser.get_log("browser") if entry["level"] in {"SEVERE", "WARNING"}]


def test_the_page_follows_a_session_that_another_process_runs(browser, lab):
    with monitoring(lab.path) as address, another_process_runs(lab, "P003") as session:
        browser.get(address)
        browser.execute_script("window.never_reloaded = true; window.scrollTo(0, 120)")
        one(browser, "[id^=rows-] summary").click()
        scrolled = browser.execute_script("return window.scrollY")
        for number in range(1, 5):
            until(browser, lambda b, done=number - 1: f"running {done} of 4" in row(b, "P003"))
            (lab.path / "gate" / str(number)).touch()
        until(browser, lambda b: "complete 4 of 4" in row(b, "P003"))
        assert session.wait(PATIENCE_S) == 0
        assert browser.execute_script("return window.never_reloaded")
        assert browser.execute_script("return window.scrollY") == scrolled
        assert one(browser, "[id^=rows-]").get_attribute("open") is not None
        assert complaints(browser) == []


def test_finished_sessions_their_balance_and_a_straight_liner_stand_on_the_page(browser, lab):
    with monitoring(lab.path) as address:
        browser.get(address)
        assert "complete 8 of 8" in row(browser, "P001")
        assert "2 sequences of 4 items: not balanced (yet)" in one(browser, "#balance .verdict").text
        assert len(browser.find_elements("css selector", "svg.strip rect.complete")) == 2
        assert len(browser.find_elements("css selector", "svg.strip rect.free")) == 2
        cells = [cell.text for cell in browser.find_elements("css selector", "table.heat tbody tr:first-child td")]
        assert (len(cells), sum(map(int, cells))) == (8, 4)  # eight positions; one stimulus, twice by two people
        flagged = one(browser, "tr.flagged")
        assert "P002" in flagged.text
        assert "8 of 8 trials have one value on all items (100%)" in one(browser, "tr.flagged + tr.findings").text
        assert len(browser.find_elements("css selector", "tr.flagged")) == 1
        assert "<b>bold</b>" in one(browser, "#notes").text
        assert browser.find_elements("css selector", "#notes td b") == []
        assert complaints(browser) == []


def test_the_page_cannot_be_written_to_and_says_when_the_monitor_is_gone(browser, lab):
    with monitoring(lab.path) as address:
        browser.get(address)
        status = browser.execute_async_script(
            "fetch('/', {method: 'POST'}).then((answer) => arguments[0](answer.status))"
        )
        assert status == 405
        assert not one(browser, "#lost").is_displayed()
    until(browser, lambda b: one(b, "#lost").is_displayed())
    assert "The monitor does not answer" in one(browser, "#lost").text
    browser.get_log("browser")


def test_a_token_is_requested_and_remembered(browser, lab):
    token = "a-token-of-good-length"
    with monitoring(lab.path, "--token", token) as address:
        plain = address.partition("?")[0]
        browser.get(plain)
        assert "A token is needed" in one(browser, "body").text
        assert "P001" not in browser.page_source
        browser.get_log("browser")  # Chromium notes the 401.
        browser.get(address)
        assert browser.current_url == plain
        assert token not in browser.page_source
        assert browser.execute_script("return document.cookie") == ""
        until(browser, lambda b: "P001" in row(b, "P001"))
        asof = one(browser, "#asof").text
        until(browser, lambda b: one(b, "#asof").text != asof)
        assert complaints(browser) == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
def test_text_has_contrast_and_fits_on_a_phone_and_on_a_desk(browser, lab, scheme, width):
    run(lab, "P003", 2, stop_before=3)
    run(lab, "P004", 3, asides=[(2, {"do": "abort", "text": "unwell"})])
    with monitoring(lab.path) as address:
        emulate(browser, width, 900, scheme)
        browser.get(address)
        assert browser.execute_script(CONTRAST) == []  # WCAG 2.2, 1.4.3: 4.5 to 1
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    emulate(browser, 1280, 900)


def test_without_javascript_the_page_asks_anew_by_itself(browser, lab):
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        with monitoring(lab.path) as address:
            browser.get(address)
            assert "P003" not in one(browser, "#sessions").text
            run(lab, "P003", 2, changes=REPEATED)
            until(browser, lambda b: "P003" in one(b, "#sessions").text)
    finally:
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
