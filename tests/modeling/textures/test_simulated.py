"""The simulated default: deterministic, cached by what decides it, the cache checked and never trusted."""

import numpy as np
import pytest

from palpate.modeling.textures.recording import TextureDataError, joined
from palpate.modeling.textures.simulated import SIX, simulated
from tests.modeling.textures.textures_for_tests import FixedSimulator, recording


def same(one, other):
    return one.texture == other.texture and one.notes == other.notes and np.array_equal(one.signals, other.signals)


def test_six_textures_by_default_and_each_says_how_it_was_made():
    simulator = FixedSimulator()
    recordings = simulated(simulator, seconds=1.0)
    assert tuple(recording.texture for recording in recordings) == SIX
    assert all(recording.seconds == pytest.approx(1.0, abs=0.07) for recording in recordings)
    assert recordings[0].notes[0] == "simulated"
    assert recordings[0].made_from[0].startswith("simulated textured_rubber, 1 s, seed 1 ")


def test_the_cache_gives_the_same_and_only_for_the_same_question(tmp_path):
    simulator, lines, ticks = FixedSimulator(), [], iter(range(100))
    ask = {"textures": ("cloth",), "seconds": 1.0, "cache": tmp_path, "report": lines.append}
    (first,) = simulated(simulator, **ask, clock=lambda: float(next(ticks)))
    (again,) = simulated(simulator, **ask, clock=lambda: float(next(ticks)))
    assert simulator.requests == 1
    assert same(first, again)
    assert lines == ["cloth: 0.9 s captured in 1.00 s", "cloth: 0.9 s read from the cache in 1.00 s"]
    (other,) = simulated(simulator, **(ask | {"seconds": 1.2}), seed=1)
    (seeded,) = simulated(simulator, **ask, seed=2)
    assert simulator.requests == 3
    assert not same(first, other) and not same(first, seeded)


@pytest.mark.parametrize("harm", ["numbers", "cut", "words", "gone"])
def test_a_damaged_cache_is_made_again(tmp_path, harm):
    simulator = FixedSimulator()
    (first,) = simulated(simulator, ("cloth",), 1.0, cache=tmp_path)
    numbers, about = next(tmp_path.glob("*.npz")), next(tmp_path.glob("*.json"))
    data = numbers.read_bytes()
    if harm == "numbers":
        numbers.write_bytes(data[:500] + bytes([data[500] ^ 1]) + data[501:])
    elif harm == "cut":
        numbers.write_bytes(data[:100])
    elif harm == "words":
        about.write_text("{")
    else:
        numbers.unlink()
    (again,) = simulated(simulator, ("cloth",), 1.0, cache=tmp_path)
    assert simulator.requests == 2
    assert same(first, again)
    simulated(simulator, ("cloth",), 1.0, cache=tmp_path)
    assert simulator.requests == 2


def test_a_joined_recording_keeps_its_borders_in_the_cache(tmp_path, monkeypatch):
    whole = joined("t", "T", [recording(100).signals, recording(50).signals], ("a",), ("b", "c"))
    monkeypatch.setattr("palpate.modeling.textures.simulated.captured", lambda *_arguments: whole)
    for _ in range(2):
        (cached,) = simulated(FixedSimulator(), ("cloth",), 1.0, cache=tmp_path)
        assert (cached.borders, cached.made_from, cached.notes) == ((100,), ("a",), ("b", "c"))
        np.testing.assert_array_equal(cached.signals, whole.signals)
    assert len(list(tmp_path.glob("*.npz"))) == 1


def test_a_missing_stream_is_named():
    simulator = FixedSimulator()
    whole = simulator.captured
    simulator.captured = lambda *arguments: {
        name: stream for name, stream in whole(*arguments).items() if name != "tool_force"
    }
    with pytest.raises(TextureDataError, match="no stream 'tool_force'"):
        simulated(simulator, ("cloth",), 1.0)
