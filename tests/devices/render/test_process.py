import numpy as np
import pytest

from devices.render.errors import RenderError
from devices.render.hands import Scripted
from devices.render.job import Job, Sounds
from devices.render.loop import Loop
from devices.render.opened import twin_coil
from devices.render.pace import AtOnce, Wall
from devices.render.process import Rendering
from devices.render.sinks import Kept, on_coil
from devices.render.threaded import Threaded
from devices.render.voice import open_voice, play
from devices.signals import DeviceFault
from tests.devices.render.made import model, write

HAND = Scripted([100.0] * 400, [1.0] * 400)


def test_another_process_plays_what_is_played_at_once_and_tells_how_it_went(tmp_path):
    card = write(tmp_path, model())
    with Rendering(Job(Sounds(card, 7), HAND, seconds=0.2)) as running:
        record = running.wait(60.0)
        count, heard = running.trace.since(0)
    assert count == record["made"] > 0
    np.testing.assert_array_equal(heard[0], play(model(), heard[1], heard[2], 7))
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


def test_a_process_that_dies_is_told(tmp_path):
    with Rendering(Job(Sounds(write(tmp_path, model())), HAND)) as running:
        assert running.record()["ready"]["steps"] >= 0
        running._process.kill()
        running._process.join()
        with pytest.raises(RenderError, match=r"ended without a word|has ended"):
            running.switch(None)
        assert not running.running


def test_what_cannot_be_opened_is_told_by_the_one_who_asked(tmp_path):
    with pytest.raises(RenderError, match=r"no rig file there"), Rendering(Job(None, HAND, tmp_path / "rig.yaml")):
        pass
    with pytest.raises(RenderError, match=r"no hand"), Rendering(Job(None, None)):
        pass


def test_a_thread_plays_until_it_is_ended_and_tells_what_failed():
    coil = twin_coil(10)
    coil.start()
    thread = Threaded(Loop(open_voice(model(), seed=1), HAND, on_coil(coil), Wall()))
    thread.start()
    thread.end()
    assert thread.record()["ready"]["steps"] >= 0
    coil.safe()
    thread = Threaded(Loop(open_voice(model(), seed=1), HAND, on_coil(coil), Wall()))
    thread.start()
    with pytest.raises(DeviceFault, match=r"before start"):
        thread.end()
    assert not thread.running


def test_garbage_is_collected_again_once_a_thread_has_ended():
    import gc
    import sys

    before = gc.isenabled(), sys.getswitchinterval()
    thread = Threaded(Loop(open_voice(model(), seed=1), HAND, Kept(), AtOnce()))
    thread.start()
    thread.end()
    assert (gc.isenabled(), sys.getswitchinterval()) == before
