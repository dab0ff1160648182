"""Every command that writes, with every fault of the machine: a message, old files whole, nothing left over."""

import subprocess
import sys
from itertools import cycle
from pathlib import Path

import pytest

from tests.faults.commands import DATABASES, DRIVEN, LEFT_OUT, ROOT, SLOW, TEXTURES, WRITES, WRITES_NOTHING, commands
from tests.faults.machine import FULL
from tests.faults.matrix import ALWAYS, COLUMNS, PAGE, SAME_PATH, cells, outcomes, page

pytestmark = pytest.mark.needs("linux")
filters = pytest.mark.needs("seccomp")
TESTED = tuple(fault for fault in COLUMNS if fault not in SAME_PATH)
IN_TURN = tuple(fault for fault in TESTED if fault not in ALWAYS)
"""Of these, commands that write files alone, all by one writer, are driven with one each; the matrix has all."""
FILES = tuple(name for name in (*WRITES, *TEXTURES) if name not in {*DATABASES, *SLOW})
FAULTS_OF = {
    **dict.fromkeys(DATABASES, TESTED),
    **{name: (*ALWAYS, fault) for name, fault in zip(FILES, cycle(IN_TURN), strict=False)},
    **dict.fromkeys(SLOW, ALWAYS),
}
"""What the full run drives every command with; see HEAD in tests/faults/matrix.py."""
IN_THE_LAB = tuple(name for name in FAULTS_OF if name in WRITES)
README = ("init", "run", "report")
"""Commands of the README that write into a lab: the full run drives every command so."""


def drive(faults, capfd):
    """Return the outcomes of the commands with their faults; none leaves a file broken or left over."""
    results = list(outcomes(faults, lambda name: 1 if name in SLOW else 2))
    capfd.readouterr()
    assert [problem for result in results for problem in result.problems] == []
    return results


def rows_on_the_page():
    return [line for line in PAGE.read_text("utf-8").splitlines() if line.startswith("| `")]


def demand_on_the_page(outcomes):
    page = {line.split("`")[1]: cells(line) for line in rows_on_the_page()}
    wrong = [outcome for outcome in outcomes if page[outcome.command][outcome.fault] != outcome.verdict]
    assert wrong == [], "python -m tests.faults.matrix writes the page anew"


def test_every_command_is_driven_or_has_a_reason_why_not():
    known = sorted([*DRIVEN, *LEFT_OUT, *WRITES_NOTHING])
    assert known == sorted(commands()), "say in tests/faults/commands.py how it is driven, or that it writes nothing"


def test_the_page_has_a_row_of_every_command_that_is_driven():
    rows = rows_on_the_page()
    assert [line.split("`")[1] for line in rows] == list(DRIVEN)
    assert PAGE.read_text("utf-8") == page(rows), "python -m tests.faults.matrix writes the page anew"


@filters
def test_a_few_commands_leave_whole_files_whatever_the_machine_does(capfd):
    faults = [fault for fault in TESTED if fault != FULL]
    drive(dict.fromkeys(["init", "predict", "participants add"], faults), capfd)


@pytest.mark.needs("tmpfs")
def test_commands_of_the_readme_leave_whole_files_on_a_full_file_system(capfd):
    results = drive({name: [FULL] for name in README}, capfd)
    assert {result.verdict for result in results} == {"message, 2"}


@filters
@pytest.mark.long
@pytest.mark.needs("torch", "librosa", "pywt", "skimage", "tmpfs")
@pytest.mark.parametrize("where", ["a lab", "a lab of textures"])
def test_commands_leave_whole_files_and_the_page_says_what_they_do(where, capfd):
    names = [name for name in FAULTS_OF if (name in IN_THE_LAB) == (where == "a lab")]
    demand_on_the_page(drive({name: FAULTS_OF[name] for name in names}, capfd))


def test_a_full_standard_output_is_a_message():
    with Path("/dev/full").open("w") as full:
        words = [sys.executable, "-m", "palpate", "studies"]
        ended = subprocess.run(words, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (2, "Error: the standard output: no space left on the device\n")


STARTS = """
import os, signal, sys
def interrupt_at(instant):
    count = 0
    def hook(event, arguments):
        nonlocal count
        if event in ("import", "open", "compile"):
            count += 1
            if count == instant:
                signal.raise_signal(signal.SIGINT)
    sys.addaudithook(hook)
for instant in map(int, sys.argv[1:]):
    read, write = os.pipe()
    if (child := os.fork()) == 0:
        os.dup2(write, 2), os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.argv = ["palpate", "studies"]
        from palpate import __main__ as console
        interrupt_at(instant)
        console.main()
    os.close(write)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    print(instant, status, os.read(read, 9999).decode().replace(chr(10), "|"), flush=True)
"""


def test_an_interrupt_at_any_instant_of_the_start_is_one_word():
    instants = [str(k) for k in (1, 2, 5, 10, 30, 70, 150, 300, 450, 600, 800)]
    words = [sys.executable, "-c", STARTS, *instants]
    ended = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    lines = [line.split(maxsplit=1)[1].replace("|", "") for line in ended.stdout.splitlines()]
    assert len(lines) == len(instants) and set(lines) <= {"130 stopped", "0"} and lines.count("130 stopped") >= 6
