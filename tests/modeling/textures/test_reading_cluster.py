"""The Cluster Haptic Texture Dataset in the layout of its documents/dataset_details.md; each mistake is reported.

The times jitter as in that page's example: steps of 0.21 and 0.13 ms, 6 kHz on average.
"""

import numpy as np
import pytest

from palpate.modeling.textures.reading_cluster import read_cluster, slides, touched
from palpate.modeling.textures.recording import TextureDataError
from tests.modeling.textures.cluster_for_tests import slide


def test_slides_become_pieces_of_their_texture_s_recording(tmp_path):
    slide(tmp_path)
    slide(tmp_path, "0_0_60_1000_1", speed=60.0, force=1.0)
    slide(tmp_path, "17_0_20_500_0", speed=20.0)
    one, other = read_cluster(tmp_path)
    assert (one.texture, one.label, other.texture) == ("cluster_0", "cluster 0", "cluster_17")
    assert one.borders == (pytest.approx(1450, abs=15),) and len(one.made_from) == 6
    assert one.made_from[0].startswith("accel/0_0_60_1000_1.csv ")  # direction 0 comes before 135
    moving = one.speed_mm_s[500:1400], one.speed_mm_s[2000:2900]
    np.testing.assert_allclose(np.median(moving[0]), 60, rtol=0.02)
    np.testing.assert_allclose(np.median(moving[1]), 40, rtol=0.02)
    np.testing.assert_allclose(one.force_N[:1400], 1.0, atol=1e-6)
    np.testing.assert_allclose(one.force_N[1600:], 0.5, atol=1e-6)
    assert any("its times are uneven" in note for note in one.notes)
    assert any("60 mm/s, 1 N are wished for" in note for note in one.notes)
    assert [recording.texture for recording in read_cluster(tmp_path / "sensor_data", ["cluster_17"])] == ["cluster_17"]


def test_g_becomes_m_s2_and_gravity_goes(tmp_path):
    felt = slide(tmp_path)
    [[only]] = slides(tmp_path).values()
    np.testing.assert_allclose(touched(only).acceleration.values, 9.80665 * felt, atol=1e-7)
    (recording,) = read_cluster(tmp_path)
    # 0.1 g on each of three axes, resonant at 0.83 of a radian a sample (795 Hz): most of it is above 500 Hz
    assert 0.1 < recording.acceleration_m_s2.std() < 0.1 * 9.80665 * np.sqrt(3)


def test_files_of_a_texture_s_own_folder_are_found(tmp_path):
    slide(tmp_path)
    for folder in ("accel", "force", "position"):
        place = tmp_path / "sensor_data" / folder
        (place / "0").mkdir()
        (place / "0_135_40_500_0.csv").rename(place / "0" / "0_135_40_500_0.csv")
    assert [recording.texture for recording in read_cluster(tmp_path)] == ["cluster_0"]


WRONG = {
    "acceleration in m/s^2": ({"felt": np.tile([0.0, 0.0, 9.8], (9000, 1))}, "median length is 9.8; about 1 .* in g"),
    "force in mN": ({"force": 500.0}, "median force is 500, .* 0.5 N: is it in"),
    "positions in m": ({"speed": 0.04}, "moves at 0.0[34][0-9]* mm/s, .*40 mm/s: are the positions in mm"),
    "acceleration at 3 kHz": ({"rates": (3000.0, 6000.0, 100.0)}, "acceleration at 3000 Hz .*6000 Hz are documented"),
    "positions at 1 kHz": ({"rates": (6000.0, 6000.0, 1000.0)}, "position at 1000 Hz by its times; 100 Hz"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_units_and_rates_are_reported(tmp_path, case):
    changed, message = WRONG[case]
    slide(tmp_path, **changed)
    with pytest.raises(TextureDataError, match=message):
        read_cluster(tmp_path)


def edit(file, change):
    file.write_text("\n".join(change(file.read_text("utf-8").splitlines())) + "\n", "utf-8")


EDITED = {
    "a row that is cut short": ("accel", lambda rows: [*rows[:-1], rows[-1].rpartition(",")[0]], "3 cells found, 4"),
    "no such column": ("force", lambda rows: ["time,grams", *rows[1:]], "no column 'force' .*time,force is expected"),
    "an empty cell": ("position", lambda rows: [*rows[:-1], rows[-1].rpartition(",")[0] + ","], "an empty cell"),
    "half the rows": ("accel", lambda rows: [rows[0], *rows[1::2]], "acceleration at 3000 Hz"),
    "times in ms": ("force", lambda rows: [rows[0], *(f"{1000 * float(row.split(',')[0])},0.5" for row in rows[1:])],
                    "force at 6.* Hz by its times; 6000 Hz are documented: are the times in seconds"),
    "times that fall": ("position", lambda rows: [rows[0], *reversed(rows[1:])], "times do not rise"),
    "words": ("force", lambda rows: [*rows[:-1], "1.4,high"], "force is 'high', a number is expected"),
    "one row": ("force", lambda rows: rows[:2], "1 sample whose times do not rise"),
}  # fmt: skip


@pytest.mark.parametrize("case", EDITED)
def test_damaged_tables_are_reported_with_their_file(tmp_path, case):
    folder, change, message = EDITED[case]
    slide(tmp_path)
    edit(tmp_path / "sensor_data" / folder / "0_135_40_500_0.csv", change)
    with pytest.raises(TextureDataError, match=rf"{folder}/0_135_40_500_0.csv.*{message}"):
        read_cluster(tmp_path)


def test_what_is_not_there_is_reported(tmp_path):
    with pytest.raises(TextureDataError, match="no folder sensor_data/accel"):
        read_cluster(tmp_path)
    slide(tmp_path)
    with pytest.raises(TextureDataError, match="no slide over the texture 'cluster_1'"):
        read_cluster(tmp_path, ["cluster_1"])
    (tmp_path / "sensor_data" / "force" / "0_135_40_500_0.csv").unlink()
    with pytest.raises(TextureDataError, match=r"force/0_135_40_500_0.csv: no such file"):
        read_cluster(tmp_path)
    (tmp_path / "sensor_data" / "accel" / "0_135_40_500_0.csv").rename(tmp_path / "sensor_data" / "accel" / "a.csv")
    with pytest.raises(TextureDataError, match="0_135_40_500_0.csv"):
        read_cluster(tmp_path)
