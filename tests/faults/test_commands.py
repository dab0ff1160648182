"""Every command that writes, with every fault of the machine: a message, old files whole, nothing left over."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.faults.commands import LEFT_OUT, ROOT, WRITES, WRITES_NOTHING, commands
from tests.faults.matrix import PAGE, outcomes, page

pytestmark = pytest.mark.needs("linux")
filters = pytest.mark.needs("seccomp")


def test_every_command_is_driven_or_has_a_reason_why_not():
    known = sorted([*WRITES, *LEFT_OUT, *WRITES_NOTHING])
    assert known == sorted(commands()), "say in tests/faults/commands.py how it is driven, or that it writes nothing"


@filters
def test_a_few_commands_leave_whole_files_whatever_the_machine_does(capfd):
    found = list(outcomes(["init", "predict", "participants add"], instants=3))
    capfd.readouterr()
    assert [problem for each in found for problem in each.problems] == []


@filters
@pytest.mark.long
@pytest.mark.needs("torch")
def test_all_commands_leave_whole_files_and_the_page_says_what_they_do(capfd):
    found = list(outcomes(list(WRITES)))
    capfd.readouterr()
    assert [problem for each in found for problem in each.problems] == []
    assert PAGE.read_text("utf-8") == page(found), "python -m tests.faults.matrix writes the page anew"


def test_a_full_standard_output_is_a_message():
    with Path("/dev/full").open("w") as full:
        words = [sys.executable, "-m", "palpate_entry", "studies"]
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
        import palpate_entry
        interrupt_at(instant)
        palpate_entry.main()
    os.close(write)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    print(instant, status, os.read(read, 9999).decode().replace(chr(10), "|"), flush=True)
"""


def test_an_interrupt_at_any_instant_of_the_start_is_one_word():
    instants = [str(k) for k in (1, 2, 5, 10, 30, 70, 150, 300, 450, 600, 800)]
    words = [sys.executable, "-c", STARTS, *instants]
    ended = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    came = [line.split(maxsplit=1)[1].replace("|", "") for line in ended.stdout.splitlines()]
    assert len(came) == len(instants) and set(came) <= {"130 stopped", "0"} and came.count("130 stopped") >= 6
