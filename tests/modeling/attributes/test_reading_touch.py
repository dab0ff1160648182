"""What a lab's captures feel like: read one texture at a time, known by their content, sent to jobs without samples."""

import pickle
import tracemalloc

import numpy as np
import pytest

from palpate.analysis.features.touch_features import touch_features
from palpate.modeling.attributes.reading_touch import felt, filtering, recorded, rows_of, touches
from palpate.modeling.textures.reading_ledgers import NoCapture, read_lab
from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.training.jobs import run_jobs
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.withdrawal import withdraw
from tests.modeling.attributes.captured_textures import session
from tests.modeling.attributes.photo_labs import LIVE


@pytest.mark.needs("librosa", "pywt")
def test_each_texture_with_its_class_in_the_order_of_the_session(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T03"}, {"stimulus": "T01"}])
    first, second = touches(tmp_path)
    assert (first.id, first.label, first.category) == ("T03", "wood 3 of 9", "foam")
    assert (second.id, second.category) == ("T01", "wood")
    (stretch,) = first.touch.stretches
    assert stretch.axes.shape == (pytest.approx(1000, abs=15), 3)
    np.testing.assert_allclose(stretch.speed_mm_s, 120, rtol=0.02)
    np.testing.assert_allclose(stretch.force_N, 1.5, atol=0.31)
    assert touch_features(first.touch)["mfcc"].shape == (1, 520)
    assert any("upper edge of 500 Hz" in note for note in first.notes)


def test_what_is_felt_has_the_energy_that_rendering_reads_in_the_same_ledger(tmp_path):
    path = session(tmp_path, "P001", [{"stimulus": "T01"}])
    (mine,) = touches(path, way=filtering(trim_s=0))
    (other,) = read_lab(path)
    np.testing.assert_allclose(
        sum((stretch.axes**2).sum() for stretch in mine.touch.stretches), (other.acceleration_m_s2**2).sum(), rtol=1e-9
    )


def test_captures_of_two_people_are_one_texture_and_only_those_that_count(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T01"}, {"stimulus": "T02", "as_": "faulted"}])
    session(tmp_path, "P002", [{"stimulus": "T01", "seed": 9}])
    (texture,) = touches(tmp_path)
    assert len(texture.touch.stretches) == len(texture.made_from) == 2


def test_real_and_simulated_captures_are_not_mixed(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T01"}, {"stimulus": "T02"}])
    assert all("simulated" in touch.notes for touch in touches(tmp_path))
    path = session(tmp_path, "P002", [{"stimulus": "T01", "seed": 9}], rig=LIVE)
    (real,) = touches(tmp_path)
    assert real.id == "T01"
    assert real.made_from == next(touches(path)).made_from
    assert "simulated" not in real.notes
    assert "captures of simulated sessions are left out: they are not mixed with others" in real.notes
    twins = list(touches(tmp_path, simulated=True))
    assert [twin.id for twin in twins] == ["T01", "T02"]
    assert all(not twin.made_from & real.made_from and "simulated" in twin.notes for twin in twins)
    with pytest.raises(NoCapture, match="or is of a real session"):
        recorded(path, simulated=True)


def test_a_rig_some_of_whose_devices_are_twins_is_simulated(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T01"}], rig={"kind": "live", "twins": ["samples"]})
    assert "simulated" in next(touches(tmp_path)).notes


def test_who_withdrew_is_not_felt(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T01"}])
    session(tmp_path, "P002", [{"stimulus": "T01", "seed": 9}, {"stimulus": "T02"}])
    registry = open_registry(tmp_path)
    for name in ("P001", "P002"):
        enter(registry, name)
    withdraw(registry, "P002", "asked to")
    (texture,) = touches(tmp_path)
    assert len(texture.touch.stretches) == 1
    withdraw(registry, "P001", "asked to")
    with pytest.raises(TextureDataError, match="or is of a participant who withdrew"):
        list(touches(tmp_path))
    with pytest.raises(TextureDataError, match="or is of a participant who withdrew"):
        list(touches(tmp_path / "sessions" / "texture_capture_P002_s1.sqlite"))


def test_the_same_samples_are_known_wherever_they_stand(tmp_path):
    for lab, trials in (("a", {"T01": 1, "T02": 2}), ("b", {"T03": 5, "T04": 6})):
        session(tmp_path / lab, "P001", [
            {"stimulus": name, "trial": trial, "seed": place} for place, (name, trial) in enumerate(trials.items())
        ])  # fmt: skip
    one, two = recorded(tmp_path / "a")
    again, other = recorded(tmp_path / "b")
    assert one.made_from == again.made_from
    assert two.made_from == other.made_from
    assert one.made_from != two.made_from
    assert len({one.key, two.key, again.key, other.key}) == 4
    (trimmed,) = recorded(tmp_path / "a", ["T01"], way=filtering(trim_s=1))
    assert trimmed.key != one.key == recorded(tmp_path / "a", ["T01"])[0].key


@pytest.mark.needs("librosa", "pywt")
def test_jobs_get_no_samples_and_give_the_same_rows(tmp_path):
    path = session(tmp_path, "P001", [{"stimulus": f"T0{n}"} for n in (1, 2)])
    sent = [pickle.loads(pickle.dumps(recording)) for recording in recorded(tmp_path)]
    assert len(pickle.dumps(sent)) < 0.05 * path.stat().st_size
    rows = run_jobs(rows_of, sent, workers=1)
    for recording, row in zip(touches(tmp_path), rows, strict=True):
        features = touch_features(recording.touch)
        assert (row.id, row.made_from, row.notes) == (recording.id, recording.made_from, recording.notes)
        assert all(np.array_equal(row.touch[kind], features[kind]) for kind in features)


def peak_bytes(call):
    """The least of two runs: now and then the interpreter's own tables grow, which is nobody's texture."""

    def traced():
        tracemalloc.start()
        try:
            call()
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    return min(traced(), traced())


@pytest.fixture
def one_and_six(tmp_path):
    """Two labs, of one texture and of six, 3 s each; and how large the second's file is."""
    session(tmp_path / "one", "P001", [{"stimulus": "T01", "seconds": 3.0}])
    path = session(tmp_path / "six", "P001", [{"stimulus": f"T0{n}", "seconds": 3.0} for n in range(1, 7)])
    return tmp_path / "one", tmp_path / "six", path.stat().st_size


@pytest.mark.long
def test_only_one_texture_is_in_memory(one_and_six):
    one, six, size = one_and_six

    def read(lab):
        for recording in recorded(lab, way=filtering(trim_s=0.5)):
            felt(recording)

    read(one)  # What is imported and kept for the next time is no texture's.
    assert peak_bytes(lambda: read(six)) < peak_bytes(lambda: read(one)) + 0.1 * size
    assert peak_bytes(lambda: recorded(six)) < 0.15 * size


@pytest.mark.long
def test_rendering_reads_no_file_whole(one_and_six):
    one, six, size = one_and_six
    read_lab(one)
    assert peak_bytes(lambda: read_lab(six)) < peak_bytes(lambda: read_lab(one)) + 0.2 * size


def test_a_texture_or_session_that_is_not_there_and_a_recording_too_short_are_refused(tmp_path):
    with pytest.raises(TextureDataError, match="no session of texture_capture"):
        touches(tmp_path)
    session(tmp_path, "P001", [{"stimulus": "T01", "seconds": 3.0}])
    with pytest.raises(TextureDataError, match="no capture of 'T09' counts"):
        touches(tmp_path, ["T09"])
    with pytest.raises(TextureDataError, match=r"trial 1 \(T01\): nothing of its .* s is left"):
        next(touches(tmp_path))
    assert next(touches(tmp_path, way=filtering(trim_s=0.5))).touch.seconds == pytest.approx(2, abs=0.02)
