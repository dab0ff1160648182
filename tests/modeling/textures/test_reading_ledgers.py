"""Textures from ledgers: which captures count, how several join, units and axes, what is refused."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest

from palpate.modeling.textures.reading_ledgers import read_lab
from palpate.modeling.textures.recording import Joined, TextureDataError
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.withdrawal import withdraw
from tests.analysis.streams.ledgers import Written, block, block_description
from tests.modeling.attributes.captured_textures import session as captures_of
from tests.modeling.textures.textures_for_tests import vibration

SECONDS = 2.0
AXES = {"channels": ("ax", "ay", "az"), "units": ("m/s^2",) * 3}
WRENCH = {"channels": ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"), "units": ("N",) * 3 + ("N m",) * 3}
PLACE = {"channels": ("x", "y", "z", "seen"), "units": ("mm",) * 3 + ("1",)}


def capture(written, trial, attempt=1, as_="captured", level=1.0, missing="", channels=AXES, hidden=slice(0)):
    """One attempt of 2 s; the streams begin 1 s after one another's number 0 does not."""
    t = np.arange(round(120 * SECONDS)) / 120
    place = np.stack([40 * np.sin(3 * t), 40 * np.cos(3 * t), 0 * t, 1 + 0 * t], axis=1)
    place[hidden, 3] = 0
    felt = np.stack([level * vibration(round(3000 * SECONDS), trial + axis) for axis in range(3)], axis=1)
    wrench = np.tile([0.1, 0.2, 1.5, 0, 0, 0], (round(8000 * SECONDS), 1))
    start_s = 10.0 * trial
    streams = [
        block("tool_acceleration", felt + np.array([0, 0, 9.81]), 3000, t0_s=start_s, **channels),
        block("tool_force", wrench, 8000, t0_s=start_s, **WRENCH),
        block("tool_position", place, 120, t0_s=start_s, **PLACE),
    ]
    written.begin(trial, attempt)
    written.chunk(*((stream, block_description(0, stream.count)) for stream in streams if stream.stream != missing))
    written.done()
    written.end(as_)


@pytest.fixture
def lab(tmp_path):
    (tmp_path / "sessions").mkdir()
    return tmp_path


def session(lab, number=1):
    return Written(lab / "sessions" / f"texture_capture_P00{number}_s1.sqlite")


def test_attempts_that_count_of_all_sessions_make_one_recording_of_a_texture(lab):
    for number in (1, 2):
        written = session(lab, number)
        capture(written, 1, 1, "faulted", level=100.0)
        capture(written, 1, 2)
        written.record()
    (recording,) = read_lab(lab)
    assert recording.texture == "K8"
    assert isinstance(recording, Joined)
    assert len(recording.borders) == 1
    assert recording.signals.shape[1] == pytest.approx(2 * 1000 * SECONDS, abs=120)
    assert recording.acceleration_m_s2.std() == pytest.approx(np.sqrt(3) * vibration(6000).std(), rel=0.5)
    np.testing.assert_allclose(recording.speed_mm_s, 120, rtol=0.02)
    np.testing.assert_allclose(recording.force_N, 1.5, rtol=1e-6)
    assert len(recording.made_from) == 2
    assert recording.made_from[0].startswith("texture_capture_P001_s1.sqlite trial 1 ")
    (one,) = read_lab(lab / "sessions" / "texture_capture_P001_s1.sqlite")
    assert not isinstance(one, Joined)


def test_what_was_recorded_beside_the_session_is_no_recording_of_a_texture(lab):
    written = session(lab)
    capture(written, 1)
    record = read_lab(written.record().path)
    written = session(lab, 2)
    written.begin = lambda trial, attempt: (
        Written.begin(written, trial, attempt),
        written.note("reply", {"presented": True}, [block("skin_temperature", np.full((30, 1), 33.0), 1.0)]),
        written.ask_for("sense"),
    )
    capture(written, 1)
    [beside] = read_lab(written.record().path)
    assert np.array_equal(beside.signals, record[0].signals)


def test_acceleration_in_g_and_a_normal_along_another_axis(lab):
    written = session(lab)
    capture(written, 1, level=0.1, channels={"channels": ("x", "y", "z"), "units": ("g",) * 3})
    written.record()
    (recording,) = read_lab(lab, normal=(0, 1, 0))
    assert recording.acceleration_m_s2.std() == pytest.approx(0.980665 * np.sqrt(3), rel=0.5)
    np.testing.assert_allclose(recording.force_N, 0.2, rtol=1e-6)


def test_a_marker_that_was_hidden_for_long_cuts_the_recording(lab):
    written = session(lab)
    capture(written, 1, hidden=slice(100, 140))
    written.record()
    (recording,) = read_lab(lab)
    assert isinstance(recording, Joined)
    assert any("2 stretches between holes" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("how", "message"),
    [({"missing": "tool_force"}, "no stream 'tool_force' was recorded"), ({"as_": "faulted"}, "no capture counts"),
     ({"channels": {"channels": ("p", "q", "r"), "units": ("m/s^2",) * 3}}, "has the channels p, q, r"),
     ({"channels": {"channels": ("x", "y", "z"), "units": ("V",) * 3}}, "in 'V'; known are")],
)  # fmt: skip
def test_captures_that_cannot_be_used_are_refused_with_their_place(lab, how, message):
    written = session(lab)
    capture(written, 1, **how)
    written.record()
    with pytest.raises(TextureDataError, match=message):
        read_lab(lab)


def test_a_session_of_somebody_who_withdrew_is_not_read(lab):
    for name in ("P001", "P002"):
        captures_of(lab, name, [{"stimulus": "T01"}])
    registry = open_registry(lab)
    for name in ("P001", "P002"):
        enter(registry, name)
    withdraw(registry, "P002", "asked to")
    (recording,) = read_lab(lab)
    assert not isinstance(recording, Joined)
    assert [source.split()[0] for source in recording.made_from] == ["texture_capture_P001_s1.sqlite"]
    with closing(sqlite3.connect(lab / "sessions" / "texture_capture_P002_s1.sqlite")) as ledger:
        ledger.executescript("DROP TABLE samples; VACUUM")
    assert read_lab(lab)[0].made_from == recording.made_from
    withdraw(registry, "P001", "asked to")
    for place in (lab, *(lab / "sessions").glob("*.sqlite")):
        with pytest.raises(TextureDataError, match="or is of a participant who withdrew"):
            read_lab(place)


def test_captures_of_a_rig_are_not_joined_with_those_of_twins(lab):
    captures_of(lab, "P001", [{"stimulus": "T01"}])
    captures_of(lab, "P002", [{"stimulus": "T01"}], rig={"kind": "live", "twins": []})
    (real,), (twin,) = read_lab(lab), read_lab(lab, simulated=True)
    for recording, number, other in ((real, 2, "simulated"), (twin, 1, "real")):
        assert not isinstance(recording, Joined)
        assert recording.made_from[0].startswith(f"texture_capture_P00{number}")
        assert f"captures of {other} sessions are left out: they are not mixed with others" in recording.notes


def test_a_texture_or_a_session_that_is_not_there_is_refused(lab):
    with pytest.raises(TextureDataError, match="no session of texture_capture"):
        read_lab(lab)
    written = session(lab)
    capture(written, 1)
    written.record()
    with pytest.raises(TextureDataError, match="no capture of 'K9' counts"):
        read_lab(lab, textures=("K9",))
    file = next((lab / "sessions").glob("*.sqlite"))
    file.write_bytes(file.read_bytes()[:5000])
    with pytest.raises(TextureDataError):
        read_lab(lab)
