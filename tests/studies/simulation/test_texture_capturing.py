"""Explorations of simulated surfaces: through the sensors, and true; the same seed the same, another place another."""

import numpy as np
import pytest

from palpate.studies.sessions.rig import RigError
from palpate.studies.simulation.texture_capturing import captured, scene

SECONDS = 1.5


def test_what_the_twins_record_has_the_streams_of_a_session_and_repeats():
    streams = captured("cloth", SECONDS, 1)
    assert {name: (rate, values.shape) for name, (rate, values) in streams.items()} == {
        "tool_acceleration": (3000.0, (4500, 3)), "tool_force": (8000.0, (12_000, 6)),
        "tool_position": (120.0, (180, 4)),
    }  # fmt: skip
    gravity = np.linalg.norm(streams["tool_acceleration"][1].mean(axis=0))
    assert gravity == pytest.approx(9.8, abs=0.3)
    again = captured("cloth", SECONDS, 1)
    assert all(np.array_equal(streams[name][1], again[name][1]) for name in streams)


@pytest.mark.long
def test_another_place_of_a_scene_has_the_same_hand_and_another_vibration():
    one, elsewhere = scene("cloth", SECONDS, 1), scene("cloth", SECONDS, 1, 1)
    assert one.shape == (3, 1500)
    assert np.corrcoef(one[1], elsewhere[1])[0, 1] > 0.95
    assert abs(np.corrcoef(one[0], elsewhere[0])[0, 1]) < 0.3
    assert (one[1] >= 0).all()


@pytest.mark.parametrize("ask", [captured, scene])
def test_what_is_no_texture_or_no_time_is_refused(ask):
    with pytest.raises(RigError, match="there is no texture 'velvet'"):
        ask("velvet", 1.0, 1)
    with pytest.raises(RigError, match="cloth: 0.0 s"):
        ask("cloth", 0.0, 1)
