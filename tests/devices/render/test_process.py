import gc
import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from palpate.devices.render.hands import Scripted
from palpate.devices.render.job import Job
from palpate.devices.render.priority import in_front, undisturbed
from palpate.devices.render.process import Rendering
from palpate.signals.textures.sounds import RenderError, Sounds
from palpate.signals.textures.voice import open_voice, play
from tests.devices.render.made import model, write

HAND = Scripted([100.0] * 400, [1.0] * 400)
HERE = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}


class Breaks(Scripted):
    """Fails as no hand should."""

    def at(self, _sample):
        raise ZeroDivisionError("by the hand")


def test_another_process_plays_the_same_samples_and_reports_how_it_went(tmp_path):
    card = write(tmp_path, model())
    with Rendering(Job(Sounds(card, 7), HAND, seconds=0.2)) as running:
        record = running.wait(60.0)
        count, samples = running.trace.since(0)
    assert count == record["made"] > 0
    np.testing.assert_array_equal(samples[0], play(model(), samples[1], samples[2], 7))
    assert record["ready"]["steps"] >= 200
    assert record["voice"]["weights_sha256"] == open_voice(card, seed=0).card.weights.sha256
    assert record["output"]["ahead_ms"] == 10
    assert record["devices"]["actuator"]["driver"] == "twin"
    assert running.trace.since(0)[0] == count  # what was played outlives the process
    assert running.record() == record


def test_textures_are_switched_while_it_runs_and_a_bad_one_changes_nothing(tmp_path):
    first, second = write(tmp_path, model()), write(tmp_path, model(name="texture-other-ar"))
    with Rendering(Job(Sounds(first), HAND)) as running:
        with pytest.raises(RenderError, match=r"there is no such file"):
            running.switch(Sounds(tmp_path / "none.json"))
        running.switch(Sounds(second))
        assert running.record()["voice"]["model"] == "texture-other-ar"
        running.switch(None)
        assert running.record()["voice"] is None
        assert running.running
    assert not running.running
    with pytest.raises(RenderError, match=r"not running"):
        running.switch(None)


def test_a_process_that_dies_is_reported(tmp_path):
    with Rendering(Job(Sounds(write(tmp_path, model())), HAND)) as running:
        assert running.record()["ready"]["steps"] >= 0
        running._process.kill()
        running._process.join()
        with pytest.raises(RenderError, match=r"process ended by signal 9|has ended"):
            running.switch(None)
        with pytest.raises(RenderError, match=r"process ended by signal 9"):
            running.wait(0.0)
        assert not running.running


def test_what_cannot_be_opened_raises_in_the_calling_process(tmp_path):
    with pytest.raises(RenderError, match=r"no rig file there"), Rendering(Job(None, HAND, tmp_path / "rig.yaml")):
        pass
    with pytest.raises(RenderError, match=r"no hand"), Rendering(Job(None, None)):
        pass


def test_failures_of_the_renderer_are_reported_in_words(tmp_path, capfd):
    with Rendering(Job(Sounds(write(tmp_path, model())), Breaks([1.0], [1.0]))) as running:
        with pytest.raises(RenderError, match=r"the renderer failed.*ZeroDivisionError: by the hand"):
            running.wait(60.0)
        running._process.join()
        assert not running.running
    assert "ZeroDivisionError" in capfd.readouterr().err  # a fault of ours: where it was stays to be seen


@pytest.mark.needs("posix")
def test_what_a_terminal_sends_to_all_does_not_tear_it_off_and_who_ends_it_has_its_last_word(tmp_path):
    with Rendering(Job(Sounds(write(tmp_path, model())), HAND)) as running:
        pid = running._process.pid
        assert os.getsid(pid) == pid
        os.kill(pid, signal.SIGINT)
        assert running.record()["ready"]["steps"] >= 0
        assert running.running
        os.kill(pid, signal.SIGTERM)
        running._process.join(60.0)
        assert running._process.exitcode == 0
        assert running.record()["made"] > 0


OWNER = """
import os, sys
from palpate.devices.render.hands import Scripted
from palpate.devices.render.job import Job
from palpate.devices.render.process import Rendering
if __name__ == "__main__":
    with Rendering(Job(None, Scripted([], []))) as running:
        print(running._process.pid, flush=True)
        os.kill(os.getpid(), 9)
"""


def test_it_ends_with_a_process_that_is_killed(tmp_path):
    script = tmp_path / "owner.py"
    script.write_text(OWNER)
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, env=HERE) as owner:
        renderer = int(owner.stdout.readline())
        try:
            owner.communicate(timeout=60)  # until nobody holds the other end of the pipe, which the renderer does
        finally:
            with suppress(ProcessLookupError):
                os.kill(renderer, signal.SIGKILL)
    assert owner.returncode == -signal.SIGKILL


def test_garbage_is_collected_again_afterwards():
    before = gc.isenabled(), sys.getswitchinterval()
    with undisturbed():
        assert not gc.isenabled()
        assert sys.getswitchinterval() < 0.001
    assert (gc.isenabled(), sys.getswitchinterval()) == before


@pytest.mark.needs("linux")
def test_what_the_system_granted_is_reported():
    granted, shown = {}, []

    def look():
        granted.update(in_front(real_time=False))
        lines = Path("/proc/thread-self/sched").read_text().splitlines()
        shown.extend(int(line.split(":")[1]) for line in lines if line.startswith("se.slice "))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert (granted["priority"], granted["memory"]) == ("normal", "not locked")
    assert (granted["slices"] == "100 us") == (shown == [100_000])
