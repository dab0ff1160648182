"""Recordings in the layouts of the Penn Haptic Texture Toolkit; each mistake is reported with its file.

The files are made here, in the toolkit's own way of writing numbers (its models: <ARlsf type="array"><value>...).
"""

import numpy as np
import pytest

from palpate.modeling.textures.reading_hatt import read_hatt, sources, touched
from palpate.modeling.textures.recording import TextureDataError
from tests.modeling.textures.hatt_for_tests import UNITS, array, signals, whole


def test_a_file_with_everything_in_it(tmp_path):
    (tmp_path / "ABS_Plastic.xml").write_text(whole(), "utf-8")
    (recording,) = read_hatt(tmp_path / "ABS_Plastic.xml")
    felt, speed, force, _ = signals()
    assert (recording.texture, recording.label, recording.seconds) == (
        "ABS_Plastic",
        "ABS Plastic",
        pytest.approx(0.8, abs=0.002),
    )
    np.testing.assert_allclose(recording.speed_mm_s[100:-100], speed[::10][100:-100], rtol=0.02)
    np.testing.assert_allclose(recording.force_N[100:-100], force[::10][100:-100], rtol=0.02)
    assert recording.made_from[0].startswith("ABS_Plastic.xml ") and any(
        "Penn Haptic" in note for note in recording.notes
    )
    (source,) = sources(tmp_path)
    np.testing.assert_allclose(touched(source).acceleration.values, felt, atol=1e-6)
    assert touched(source).acceleration.rate_hz == 10_000


def test_a_folder_for_each_signal_as_a_study_of_the_toolkit_s_data_reads_them(tmp_path):
    felt, speed, force, _ = signals()
    for folder, text in (("Accel", array("accel", felt[:, 0])), ("Force", array("anything", force)),
                         ("Speed", array("speed", speed))):  # fmt: skip
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "Felt.xml").write_text(f"<recording>{text}</recording>", "utf-8")
    (recording,) = read_hatt(tmp_path)
    assert len(recording.made_from) == 3 and recording.texture == "Felt"
    assert any("the file gives no rate" in note for note in recording.notes)
    assert any("acceleration in m/s^2: the file gives no unit" in note for note in recording.notes)
    np.testing.assert_allclose(recording.force_N[100:-100], force[::10][100:-100], rtol=0.02)
    (tmp_path / "Speed" / "Felt.xml").unlink()
    with pytest.raises(TextureDataError, match=r"Speed/Felt.xml: no such file"):
        read_hatt(tmp_path)


def test_units_are_converted_and_positions_stand_in_for_a_speed(tmp_path):
    text = whole({**UNITS, "AccelUnits": "g", "ForceUnits": "mN", "PositionUnits": "m", "SpeedUnits": "m/s"})
    text = text.replace("<Speed>", "<Other>").replace("</Speed>", "</Other>")
    (tmp_path / "a.xml").write_text(text, "utf-8")
    (source,) = sources(tmp_path / "a.xml")
    touch = touched(source)
    felt, _, force, place = signals()
    np.testing.assert_allclose(touch.acceleration.values, 9.80665 * felt, atol=1e-4)
    np.testing.assert_allclose(touch.force.values[:, 0], 1e-3 * force, atol=1e-8)
    assert touch.speed is None
    np.testing.assert_allclose(touch.position.values, 1000 * place, atol=2e-3)


WHOLE = whole()
REFUSED = {
    "a rate that is none": (whole(rate="often"), "SampleRate is 'often'"),
    "another rate than that of the positions": (whole(rate=1000), "the positions tell .* SampleRate .1000 Hz. right"),
    "an unknown unit": (whole({**UNITS, "ForceUnits": "lbf"}), "force in 'lbf'; known are N"),
    "g where m/s^2 is said to be g": (whole({**UNITS, "SpeedUnits": "m/s"}), "SpeedUnits and PositionUnits"),
    "a force that is cut short": (whole(force_n=6000), "signals of different lengths: acceleration 8000 .*force 6000"),
    "a file that is cut short": (WHOLE[:90_000], "no whole XML"),
    "no number": (WHOLE.replace("<value>1", "<value>one", 1), "a number is expected"),
    "not finite": (WHOLE.replace("<Speed>", "<Speed>nan ", 1), "speed, sample 1, is nan"),
    "an axis too few": (WHOLE.replace('<y type="array">', '<w type="array">', 1).replace("</y>", "</w>", 1),
                        "accel has the axes x, z; x, y and z"),
    "no force": (WHOLE.replace("ForceNormal", "Weight"), "no force"),
    "entities": (whole(declared='<!DOCTYPE a [<!ENTITY b "c">]>'), "it declares entities"),
    "a model": ("<modelSet><model/></modelSet>", "a model of a texture, no recording"),
    "not XML": ("time,acceleration", "no whole XML"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_wrong_is_reported(tmp_path, case):
    text, message = REFUSED[case]
    (tmp_path / "Felt.xml").write_text(text, "utf-8")
    with pytest.raises(TextureDataError, match=message):
        read_hatt(tmp_path / "Felt.xml")


def test_laughs_and_foreign_files_are_not_followed(tmp_path):
    laughs = '<!DOCTYPE a [<!ENTITY x "ha"><!ENTITY y "&x;&x;&x;">]><recording><Accel>&y;</Accel></recording>'
    (tmp_path / "laughs.xml").write_text(laughs, "utf-8")
    secret = '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]><recording><Accel>&x;</Accel></recording>'
    (tmp_path / "secret.xml").write_bytes(secret.encode("utf-16"))
    with pytest.raises(TextureDataError, match="declares entities"):
        read_hatt(tmp_path / "laughs.xml")
    with pytest.raises(TextureDataError, match="not UTF-8"):
        read_hatt(tmp_path / "secret.xml")


def test_names_that_are_not_there(tmp_path):
    with pytest.raises(TextureDataError, match="no such file or folder"):
        read_hatt(tmp_path / "none")
    with pytest.raises(TextureDataError, match="no XML file"):
        read_hatt(tmp_path)
    (tmp_path / "Felt.xml").write_text(whole(), "utf-8")
    with pytest.raises(TextureDataError, match="no recording of 'Fleece'; there are Felt"):
        read_hatt(tmp_path, ["Fleece"])
