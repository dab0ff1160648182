import pytest

from palpate.devices.device import DeviceFault
from palpate.devices.render.hands import OnTablet, Pushed, Scripted
from palpate.devices.render.job import Job
from palpate.devices.render.loop import AtOnce
from palpate.devices.render.opened import playing, sounding, warm
from palpate.devices.render.trace import Trace
from palpate.devices.tablet.pipeline import Shape
from palpate.signals.textures.sounds import RenderError, Sounds
from tests.devices.render.made import model, write

RIG = """rig: bench
devices:
  stylus: {kind: tablet, driver: twin}
  actuator: {kind: voice_coil, driver: twin, ahead_ms: 8}
needs:
  texture_renderer: [stylus, actuator]
"""
HAND = Scripted([100.0] * 20, [1.0] * 20)


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text(RIG)
    return path


def test_a_rigs_stylus_is_read_and_its_actuator_played(tmp_path, rig):
    job = Job(Sounds(write(tmp_path, model()), 1), None, rig, ahead=6)
    with playing(job, Trace.own(), AtOnce()) as player:
        player.loop.run(5)
        record = player.record()
    assert isinstance(player.hand, OnTablet)
    assert set(record["devices"]) == {"stylus", "actuator"}
    assert record["output"]["ahead_ms"] == 6
    assert record["made"] >= 6
    assert "dying away" in record["output"]["when_late"]
    with pytest.raises(DeviceFault):
        player.sink.write([0.0])  # it is silent and let go of


@pytest.mark.parametrize(("hand", "kind"), [(HAND, Scripted), (Shape(), Pushed)])
def test_where_the_hand_is_given_the_rigs_stylus_is_left_alone(tmp_path, rig, hand, kind):
    with playing(Job(Sounds(write(tmp_path, model())), hand, rig, ahead=8), Trace.own(), AtOnce()) as player:
        player.loop.run(5)
        assert isinstance(player.hand, kind)
        assert set(player.record()["devices"]) == {"actuator"}


def test_a_longer_buffer_than_the_actuators_is_refused(tmp_path, rig):
    job = Job(None, HAND, rig, ahead=9)
    with pytest.raises(RenderError, match=r"9 ms ahead; 1 to 8"), playing(job, Trace.own(), AtOnce()):
        pass


def test_warming_leaves_the_voice_at_rest_and_silence_can_be_warmed(tmp_path):
    voice = sounding(Sounds(write(tmp_path, model())))
    warm(voice)
    assert voice.tally.sounding > 0
    assert not any(voice.step(0.0, 0.0) for _ in range(20)[10:])
    warm(None)
