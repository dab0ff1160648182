"""Other people's recordings beside a table of ratings: HaTT, the Cluster data set and tables become features."""

import numpy as np
import pytest

from palpate.modeling.attributes.feature_cache import FOLDER
from palpate.modeling.attributes.reading_folder import read_folder
from palpate.modeling.attributes.reading_recordings import Recordings, recording_files
from palpate.modeling.textures.reading_tables import Held
from palpate.modeling.textures.recording import TextureDataError
from tests.analysis.features.picture_specimens import write_picture
from tests.modeling.attributes.recordings_for_tests import rated, table
from tests.modeling.textures.cluster_for_tests import slide
from tests.modeling.textures.hatt_for_tests import whole


def read(place, recordings, **options):
    return read_folder(place, recordings=recordings, **{"quick": True, "variants": 0, "workers": 1, **options})


@pytest.mark.needs("librosa", "pywt")
def test_slides_of_the_cluster_data_set_become_segments_of_its_textures(tmp_path):
    data = tmp_path / "texture_dataset"
    slide(data)
    slide(data, "0_0_60_1000_1", speed=60.0, force=1.0)
    slide(data, "17_0_20_500_0", speed=20.0)
    slide(data, "20_0_20_500_0", speed=20.0)
    material = read(rated(tmp_path / "mine", "cluster_17", "cluster_0"), Recordings(cluster=data))
    (last, first), (loose, *_) = material.textures, material.notes
    assert loose == "recorded, but not in the table: cluster_20"
    assert (first.id, first.label, first.category) == ("cluster_0", "cluster_0 it is", "wood")
    assert first.touch["mfcc"].shape == (4, 520) and last.touch["mfcc"].shape == (2, 520)
    assert first.touch["hand"].shape == (4, 6) and {len(rows) for rows in first.touch.values()} == {4}
    assert len(first.made_from) == 2 and not first.made_from & last.made_from
    assert "not photographed" in first.notes and first.sight == {} and material.weights == ""
    assert not any("quick look" in note for note in material.notes)
    np.testing.assert_array_equal(first.rated.mean, [20, 31, 60, 5])


@pytest.mark.needs("librosa", "pywt")
@pytest.mark.long
def test_a_recording_of_the_toolkit_is_trimmed_as_in_the_thesis(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "ABS_Plastic.xml").write_text(whole(n=60_000), "utf-8")
    (texture,) = read(rated(tmp_path / "mine", "ABS_Plastic"), Recordings(hatt=tmp_path / "data")).textures
    assert len(texture.touch["mfcc"]) == 2  # of 6 s, less 2.5 s at both ends
    (texture,) = read(rated(tmp_path / "mine", "ABS_Plastic"), Recordings(hatt=tmp_path / "data", trim_s=0.5)).textures
    assert len(texture.touch["mfcc"]) == 10


@pytest.mark.needs("librosa", "pywt")
def test_one_that_is_too_short_is_left_out_with_what_would_help(tmp_path):
    table(tmp_path / "data", "oak", seconds=1.9)
    recordings = Recordings(tables=(tmp_path / "data",))
    table(tmp_path / "data", "felt", seconds=6.0)
    texture, longer = read(rated(tmp_path / "mine", "oak", "felt"), recordings).textures
    assert len(longer.touch["mfcc"]) == 2
    assert texture.touch == {} and "no recording of it can be used" in texture.notes
    assert "oak.csv: nothing of its 1.90 s is left" in texture.notes[0] and "trim less (--trim-s)" in texture.notes[0]
    table(tmp_path / "data", "oak", seconds=0.4)
    whole_one = Recordings(tables=(tmp_path / "data",), trim_s=0)
    texture = read(rated(tmp_path / "mine", "oak", "felt"), whole_one).textures[0]
    assert texture.notes[0].endswith("is 0.4 s; a segment takes 0.5 s: record longer")
    table(tmp_path / "data", "oak", seconds=1.9)
    assert len(read(rated(tmp_path / "mine", "oak"), whole_one).textures[0].touch["dft"]) == 3


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_what_was_felt_and_what_was_seen_come_together_by_name(tmp_path):
    for seed, name in enumerate(("oak", "felt")):
        table(tmp_path / "data", name, seed=seed)
    mine = rated(tmp_path / "mine", "oak", "felt", "cork")
    for name in ("oak", "cork"):
        write_picture(mine / f"{name}.png", 256, len(name))
    material = read(mine, Recordings(tables=(tmp_path / "data",), trim_s=0))
    oak, felt, cork = material.textures
    assert oak.touch["mfcc"].shape[0] == 8 and oak.sight["glcm"].shape == (1, 256)
    assert len(oak.made_from) == 2
    assert felt.touch and felt.sight == {} and "not photographed" in felt.notes
    assert cork.sight and cork.touch == {} and "not recorded" in cork.notes
    assert material.weights.startswith("random")


@pytest.mark.needs("librosa", "pywt")
def test_features_are_kept_by_content_and_by_how_the_table_is_read(tmp_path):
    table(tmp_path / "data", "oak")
    mine, lab = rated(tmp_path / "mine", "oak"), tmp_path / "lab"
    one = read(mine, Recordings(tables=(tmp_path / "data",), trim_s=0), lab=lab)
    (tmp_path / "data" / "oak.csv").rename(tmp_path / "oak.csv")
    again = read(mine, Recordings(tables=(tmp_path / "oak.csv",), trim_s=0), lab=lab)
    np.testing.assert_array_equal(one.textures[0].touch["mfcc"], again.textures[0].touch["mfcc"])
    assert len(list((lab / FOLDER).glob("*.npz"))) == 1
    read(mine, Recordings(tables=(tmp_path / "oak.csv",), trim_s=0.5), lab=lab)
    read(mine, Recordings(tables=(tmp_path / "oak.csv",), trim_s=0, held=Held(speed_mm_s=50.0)), lab=lab)
    assert len(list((lab / FOLDER).glob("*.npz"))) == 3


def test_names_that_do_not_meet_are_reported(tmp_path):
    for name in ("oak", "felt"):
        table(tmp_path / "data", name)
    with pytest.raises(TextureDataError, match=r"no recording is of a texture in the table: recordings of felt, oak"):
        read(rated(tmp_path / "mine", "T1"), Recordings(tables=(tmp_path / "data",)))
    with pytest.raises(TextureDataError, match="sensor_data/accel"):
        recording_files(Recordings(cluster=tmp_path / "data"), {"cluster_0": ("", "")})


@pytest.mark.needs("librosa", "pywt")
def test_a_file_s_new_name_is_a_new_recording_since_it_says_what_was_wished_for(tmp_path):
    data, mine, lab = tmp_path / "data", rated(tmp_path / "mine", "cluster_3", "cluster_4"), tmp_path / "lab"
    slide(data, "3_0_10_500_0", speed=40.0)
    slide(data, "4_0_40_500_0", speed=40.0)
    refused, fine = read(mine, Recordings(cluster=data), lab=lab).textures
    assert "its name says 10 mm/s" in " ".join(refused.notes).replace("the file's name", "its name") and fine.touch
    for folder in ("accel", "force", "position"):
        place = data / "sensor_data" / folder
        (place / "3_0_10_500_0.csv").rename(place / "3_0_40_500_0.csv")
    assert read(mine, Recordings(cluster=data), lab=lab).textures[0].touch


@pytest.mark.needs("librosa", "pywt")
def test_missing_recordings_of_a_texture_that_is_not_in_the_table_are_not_reported(tmp_path):
    data = tmp_path / "data"
    for stem in ("0_0_40_500_0", "3_0_40_500_0"):
        slide(data, stem)
    (data / "sensor_data" / "force" / "3_0_40_500_0.csv").unlink()
    (texture,) = read(rated(tmp_path / "mine", "cluster_0"), Recordings(cluster=data)).textures
    assert texture.touch
    with pytest.raises(TextureDataError, match="every slide has one in accel, force and position"):
        read(rated(tmp_path / "mine", "cluster_0", "cluster_3"), Recordings(cluster=data))
    toolkit = tmp_path / "toolkit"
    for folder, names in {"Accel": ("oak", "cork"), "Force": ("oak",), "Speed": ("oak",)}.items():
        (toolkit / folder).mkdir(parents=True)
        for name in names:
            (toolkit / folder / f"{name}.xml").write_text(whole(n=60_000), "utf-8")
    assert Recordings(hatt=toolkit).names() == ("cork", "oak")
    assert list(Recordings(hatt=toolkit).sources(["oak"])) == ["oak"]
    with pytest.raises(TextureDataError, match="Force/cork.xml: no such file"):
        Recordings(hatt=toolkit).sources(["cork"])


@pytest.mark.needs("librosa", "pywt")
def test_one_that_cannot_be_read_is_left_out_by_name_and_ratings_are_no_recording(tmp_path):
    mine = rated(tmp_path / "mine", "oak", "felt", "cork")
    for name in ("oak", "felt"):
        table(mine, name)
    (mine / "cork.csv").symlink_to(tmp_path / "nowhere")
    (mine / "silk.csv").mkdir()
    material = read(mine, Recordings(tables=(mine,), trim_s=0), table=mine / "ratings.csv")
    oak, _felt, cork = material.textures
    assert oak.touch and cork.touch == {}
    assert cork.notes[0].startswith("recordings left out: ") and "cork.csv: cannot be read" in cork.notes[0]
    assert not any("not in the table" in note for note in material.notes)


@pytest.mark.needs("librosa", "pywt")
def test_without_sight_no_picture_is_looked_at(tmp_path):
    mine = rated(tmp_path / "mine", "oak")
    table(tmp_path / "data", "oak")
    write_picture(mine / "oak.png", 256, 0)
    material = read(mine, Recordings(tables=(tmp_path / "data",), trim_s=0), sight=False)
    assert material.textures[0].touch and material.textures[0].sight == {} and material.weights == ""
    assert not any("photographed" in note for note in (*material.notes, *material.textures[0].notes))
    assert not any("left aside" in note for note in material.notes)
