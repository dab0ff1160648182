from __future__ import annotations

import json
import re
import socket
import subprocess
import sys

import pytest
from click.testing import CliRunner

from palpate import command_line
from palpate.analysis.monitoring.commands import monitor
from palpate.analysis.monitoring.watching import MonitorError
from tests.analysis.monitoring.people_for_tests import run, straight
from tests.studies.labs import Lab


@pytest.fixture
def lab(tmp_path):
    built = Lab(tmp_path / "lab")
    run(built, "P001", changes={"order": {"design": "williams", "repeats": 2}}, change=straight(1.0))
    return built


def called(*arguments):
    return CliRunner().invoke(monitor, [str(argument) for argument in arguments], catch_exceptions=False)


def test_one_file_holds_the_page_and_needs_nothing_else(lab, tmp_path):
    file = tmp_path / "pages" / "monitor.html"
    answer = called("--lab", lab.path, "--once", file)
    page = file.read_text(encoding="utf-8")
    assert answer.output == f"1 session, 0 refused: {file}\n"
    assert "P001" in page
    assert not re.findall(r"<script|http-equiv=\"refresh\"|\bsrc=|<link(?! rel=\"icon\" href=\"data:,\")", page)


def test_json_tells_a_script_what_the_page_shows(lab):
    content = json.loads(called("--lab", lab.path, "--json").output)
    (session,) = content["sessions"]
    assert (session["participant"], session["status"], session["trials_done"]) == ("P001", "complete", 8)
    assert any("one value on all items" in sentence for sentence in session["flags"])
    (group,) = content["balance"][0]["groups"]
    assert (group["rows"], group["counts"]) == (4, {"complete": 1, "free": 3})
    assert group["taken"] == [
        {"row": 0, "state": "complete", "holders": [{"participant": "P001", "status": "complete"}]}
    ]


def test_sessions_are_distinguished_where_a_study_declares_several(lab, tmp_path):
    for number in (1, 2):
        for row in (0, 1):
            run(lab, f"P00{row + 2}", row, changes={"participants": {"sessions": 2}, "session": number})
    balance = json.loads(called("--lab", lab.path, "--json").output)["balance"]
    (group,) = (group for study in balance for group in study["groups"] if group["sequences"] == 4)
    assert {number: session["sequences"] for number, session in group["sessions"].items()} == {"1": 2, "2": 2}
    assert group["taken"][0]["holders"] == [
        {"participant": "P002", "session": number, "status": "complete"} for number in (1, 2)
    ]
    called("--lab", lab.path, "--once", tmp_path / "monitor.html")
    page = (tmp_path / "monitor.html").read_text(encoding="utf-8")
    assert "P002, session 1 (complete), P002, session 2 (complete)" in page and "P001 (complete)" in page
    assert "Session 2: 2 sequences of 4 items: not balanced (yet)." in page


@pytest.mark.needs("flask")
def test_a_port_that_is_taken_is_reported(lab):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(MonitorError, match=rf"127.0.0.1, port {port}: .*give another --port"):
            called("--lab", lab.path, "--port", port)


@pytest.mark.needs("flask")
def test_an_address_that_is_not_this_machines_is_reported(lab):
    with pytest.raises(MonitorError, match=r"192\.0\.2\.1, port 0: .* as --host"):
        called("--lab", lab.path, "--host", "192.0.2.1", "--port", 0)


@pytest.mark.needs("flask")
def test_a_users_mistake_ends_with_a_message_and_exit_code_2(tmp_path, capsys):
    assert command_line._status(["monitor", "--lab", str(tmp_path / "nowhere")]) == 2
    assert capsys.readouterr().err == f"Error: {tmp_path / 'nowhere'}: no such folder; give the lab's with --lab\n"


@pytest.mark.needs("flask")
def test_a_lab_that_is_none_is_refused_before_anything_is_served(tmp_path):
    with pytest.raises(MonitorError, match="no such folder"):
        called("--lab", tmp_path / "nowhere", "--port", 0)


@pytest.mark.parametrize(
    ("arguments", "unwanted"),
    [
        (["--help"], ["flask", "waitress", "jinja2", "sqlalchemy", "pydantic", "numpy", "pandas"]),
        (["--json"], ["flask", "waitress", "jinja2", "numpy", "pandas", "scipy", "matplotlib", "devices"]),
    ],
)
def test_only_what_is_needed_is_imported(lab, arguments, unwanted):
    code = (
        "import sys\nfrom palpate.analysis.monitoring.commands import monitor\n"
        f"monitor({[*arguments, '--lab', str(lab.path)]!r}, standalone_mode=False)\n"
        f"print(sorted(set({unwanted!r}) & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


def test_a_file_that_cannot_be_written_is_reported(lab, tmp_path):
    (tmp_path / "plain").write_text("x")
    with pytest.raises(MonitorError, match=r"--once .*plain/page.html: cannot be written \(.*\); name another file"):
        called("--lab", lab.path, "--once", tmp_path / "plain" / "page.html")
