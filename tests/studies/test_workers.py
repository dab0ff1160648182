import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from palpate.studies.commands_recorded import replay
from palpate.studies.workers import WorkerDied, map_in_order, workers_for

INTERRUPTED = """
import signal
from palpate.studies.workers import map_in_order
from tests.studies.test_workers import interrupt_at_five

signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever started the tests may ignore it
if __name__ == "__main__":
    try:
        for result in map_in_order(interrupt_at_five, range(40), 2):
            pass
    except KeyboardInterrupt:
        print("stopped")
"""


def square(item):
    if item == 30:
        raise ValueError(f"{item} is refused")
    return item * item, os.getpid()


def interrupt_at_five(item):
    """Press Ctrl-C, as a terminal does: every process of the group receives it."""
    if item == 5:
        os.killpg(0, signal.SIGINT)
    return item


def die(_item):
    os._exit(3)


def test_results_come_in_order_from_several_processes():
    results = list(map_in_order(square, range(25), 2))
    assert [number for number, _ in results] == [number * number for number in range(25)]
    assert os.getpid() not in {process for _, process in results}
    assert {process for _, process in map_in_order(square, range(3), 1)} == {os.getpid()}


def test_what_a_worker_raises_comes_in_its_place():
    results = map_in_order(square, range(60), 2)
    assert [next(results)[0] for _ in range(30)] == [number * number for number in range(30)]
    with pytest.raises(ValueError, match="30 is refused"):
        next(results)


def test_a_worker_that_dies_is_reported_in_a_sentence():
    with pytest.raises(WorkerDied, match="continue with --workers 1"):
        list(map_in_order(die, [1, 2], 2))


@pytest.mark.needs("posix")
def test_an_interrupt_ends_it_without_a_word_from_the_workers(tmp_path):
    script = tmp_path / "interrupted.py"
    script.write_text(INTERRUPTED)
    done = subprocess.run(
        [sys.executable, script], check=False, start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(Path.cwd())},
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "stopped\n", "")


def test_few_items_take_no_further_process():
    assert workers_for(39) == 1 and workers_for(10, 4) == 4 and workers_for(2, 4) == 2 and workers_for(0, 4) == 1


def test_replay_says_the_same_in_one_process_and_in_two():
    ledgers = sorted(str(path) for path in Path("tests/recorded/sessions").glob("*.sqlite"))[:4]

    def replayed(workers):
        done = CliRunner().invoke(replay, [*ledgers, "--workers", workers, "--json"])
        return done.exit_code, [{**row, "seconds": 0} for row in json.loads(done.stdout)]

    assert replayed("2") == replayed("1")
    assert [row["ledger"] for row in replayed("1")[1]] == ledgers
