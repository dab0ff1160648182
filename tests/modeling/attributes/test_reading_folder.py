"""Other people's pictures and ratings: columns by both words, files by id, everything odd refused with its line."""

import hashlib

import numpy as np
import pytest

from palpate.modeling.attributes.material import MaterialError, Pair
from palpate.modeling.attributes.reading_folder import columns_of, rated_in, read_folder
from tests.analysis.features.picture_specimens import write_picture

HEADER = "id,label,category,Rough-Smooth,Flat-Bumpy,Sticky-Slippery,Hard-Soft"
PAIRS = (Pair("Rough", "Smooth"), Pair("Flat", "Bumpy"), Pair("Sticky", "Slippery"), Pair("Hard", "Soft"))
ROWS = ("T1,oak,wood,20,30,60,5", "T2,felt,fabric,80,10,40,70")


def folder_of(place, *lines, pictures=("T1_01.png", "T1_02.png", "T2/a.jpg")):
    (place / "ratings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for seed, name in enumerate(pictures):
        write_picture(place / name, 256, seed)
    return place


def read(place, **options):
    return read_folder(place, **{"quick": True, "variants": 0, "workers": 1, **options})


@pytest.mark.needs("torch", "skimage")
def test_pictures_and_ratings_become_textures(tmp_path):
    folder_of(tmp_path, HEADER, *ROWS)
    material = read(tmp_path, lab=tmp_path / "lab", simulated=True)
    one, other = material.textures
    assert (one.id, one.label, one.category) == ("T1", "oak", "wood")
    assert one.sight["resnet"].shape == (2, 2048) and other.sight["glcm"].shape == (1, 256)
    assert material.attributes == PAIRS and material.simulated
    np.testing.assert_array_equal(one.rated.mean, [20, 30, 60, 5])
    assert np.isnan(one.rated.sd).all() and one.rated.raters == 0
    files = ("T1_01.png", "T1_02.png")
    assert one.made_from == {hashlib.sha256((tmp_path / name).read_bytes()).hexdigest() for name in files}
    assert "not recorded" in one.notes and one.variants == {} and one.touch == {}
    assert material.weights.startswith("random (He normal, seed 0)")
    assert any("quick look" in note for note in material.notes)
    assert len(list((tmp_path / "lab" / "features").glob("*.npz"))) == 3


def columns(header, pairs=PAIRS):
    return columns_of("ratings.csv, line 1", header.split(","), pairs)


def rated(header, row, scale=(0.0, 100.0), pairs=PAIRS):
    cells = dict(zip(header.split(","), row.split(","), strict=True))
    return rated_in(cells, "ratings.csv, line 2", columns(header, pairs), scale)


@pytest.mark.parametrize("name", ["Rough-Smooth", "rough_smooth", "rough to smooth", "Rough / Smooth", "ROUGH–SMOOTH"])
def test_an_attribute_is_named_by_both_its_words(name):
    assert columns(f"id,{name}", PAIRS[:1]).pairs == PAIRS[:1]


def test_a_scale_around_zero_and_a_pair_turned_round_come_onto_0_to_100():
    header = "id,Smooth-Rough,Flat-Bumpy,Smooth-Rough.sd,raters"
    rating = rated(header, "T1,-100,50,20,12", (-100.0, 100.0), PAIRS[:2])
    np.testing.assert_array_equal(rating.mean, [100, 75])
    np.testing.assert_array_equal(rating.sd, [10, np.nan])
    assert rating.raters == 12
    assert columns(header, PAIRS[:2]).notes == ("column 'Smooth-Rough' turned: 0 is Rough, 100 Smooth",)


def test_other_attributes_are_those_that_are_named():
    pairs = (Pair("Cold", "Warm"),)
    assert rated("id,warm-cold", "T1,25", pairs=pairs).mean.tolist() == [75]
    assert rated("id,warm-cold", "T1,", pairs=pairs) is None


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("Rough-Smooth", "a column 'id' is expected"),
        ("id,Rough-Smooth,Rough-Smooth", "'Rough-Smooth' appears there twice"),
        ("id,Rough-Smooth,rough_smooth", "two columns rate it: Rough-Smooth, rough_smooth"),
        ("id,Rough-Smooth,colour", "no column is called 'colour'"),
        ("id,Rough", "'Rough' names one word of an attribute; both its words say which end is which: Rough-Smooth"),
        ("id,label", "one column 'Rough-Smooth' is expected, the mean rating on it; found id, label"),
        ("id,Rough-Smooth,Flat-Bumpy.sd", "'Flat-Bumpy.sd' is an SD, and no column 'Flat-Bumpy' is there"),
    ],
)
def test_unknown_missing_and_twofold_columns_are_refused(header, message):
    with pytest.raises(MaterialError, match=f"line 1: .*{message}"):
        columns(header, PAIRS[:1])


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("T1,101,1,3", "Rough-Smooth is 101, a mean rating on the scale from 0 to 100 is expected"),
        ("T1,-1,1,3", "Rough-Smooth is -1, a mean rating"),
        ("T1,rough,1,3", "Rough-Smooth is 'rough', a finite number"),
        ("T1,nan,1,3", "Rough-Smooth is 'nan', a finite number"),
        ("T1,5,-1,3", "Rough-Smooth.sd is -1, an SD of 0 or more"),
        ("T1,5,1,2.5", "raters is 2.5, a whole number"),
        ("T1,5,1,0", "raters is 0, a whole number"),
    ],
)
def test_numbers_that_are_no_ratings_are_refused_with_their_line(row, message):
    with pytest.raises(MaterialError, match=f"line 2: {message}"):
        rated("id,Rough-Smooth,Rough-Smooth.sd,raters", row, pairs=PAIRS[:1])


def test_some_ratings_without_the_others_are_refused():
    with pytest.raises(MaterialError, match="Flat-Bumpy is '', a finite number"):
        rated("id,Rough-Smooth,Flat-Bumpy", "T1,5,", pairs=PAIRS[:2])


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ((HEADER, *ROWS, "T1,x,y,1,1,1,1"), "line 4: the texture 'T1' stood at .*line 2 already"),
        ((HEADER, *ROWS, "T3,x,y,1,1,1,1"), "line 4: no picture of 'T3'; .*T3/.*jpg or .*T3_01.jpg are expected"),
        ((HEADER, "T1,x,y,1,1,1"), "line 2: 6 cells found, 7 columns are expected"),
        ((HEADER, ",x,y,1,1,1,1"), "line 2: the column 'id' is empty"),
        ((HEADER, "../T1,x,y,1,1,1,1"), "line 2: '../T1' cannot name a file"),
        ((HEADER,), "no texture under the header"),
        (("",), "a column 'id' is expected"),
    ],
)
def test_tables_that_do_not_fit_their_pictures_are_refused(tmp_path, lines, message):
    folder_of(tmp_path, *lines)
    with pytest.raises(MaterialError, match=message):
        read(tmp_path)


def test_a_picture_counts_once(tmp_path):
    folder_of(tmp_path, HEADER, *ROWS)
    (tmp_path / "T2_05.png").write_bytes((tmp_path / "T1_01.png").read_bytes())
    with pytest.raises(MaterialError, match=r"T2 \(T2_05.png\): .*T2_05.png is the same picture as .*T1_01.png"):
        read(tmp_path)
    (tmp_path / "T2_05.png").unlink()
    folder_of(tmp_path, HEADER, *ROWS, "T1_01,x,y,1,1,1,1")
    with pytest.raises(MaterialError, match=r"T1_01.png is claimed twice"):
        read(tmp_path)


@pytest.mark.needs("torch", "skimage")
def test_a_texture_may_be_unrated_and_pictures_without_a_texture_are_reported(tmp_path):
    folder_of(tmp_path, HEADER, ROWS[0], "", "T2,felt,fabric,,,,", pictures=("T1.png", "T2/a.jpg", "T20_1.png"))
    material = read(tmp_path)
    assert material.textures[0].rated is not None and material.textures[1].rated is None
    assert "not rated" in material.textures[1].notes
    assert "left aside: 1 picture that no texture of the table has (T20_1.png first)" in material.notes


@pytest.mark.needs("torch", "skimage")
def test_the_table_is_the_one_named_or_the_only_one(tmp_path):
    folder_of(tmp_path, HEADER, ROWS[0])
    (tmp_path / "ratings.csv").rename(tmp_path / "mine.csv")
    assert read(tmp_path).ids == ("T1",)
    (tmp_path / "other.csv").write_text(f"{HEADER}\n{ROWS[1]}\n")
    with pytest.raises(MaterialError, match=r"called ratings.csv is expected; tables there: mine.csv, other.csv"):
        read(tmp_path)
    assert read(tmp_path, table=tmp_path / "other.csv").ids == ("T2",)
    with pytest.raises(MaterialError, match="no such folder"):
        read(tmp_path / "nowhere")
    with pytest.raises(MaterialError, match="the lower end comes first"):
        read(tmp_path, scale=(100.0, 0.0))


@pytest.mark.needs("torch", "skimage")
@pytest.mark.parametrize("rows", [("1,7,3,4", "2,5,1,6"), ("0.5,0.1,1,0", "0,0,1,1"), ("1.2,9.9,4.4,10", ",,,")])
def test_ratings_of_few_steps_are_not_read_as_of_0_to_100_unless_requested(tmp_path, rows):
    folder_of(tmp_path, HEADER, *(f"T{n},x,y,{row}" for n, row in enumerate(rows, start=1)))
    with pytest.raises(MaterialError, match=r"ratings.csv: all ratings lie from .* to .*: say .* --scale 1 7"):
        read(tmp_path)
    values = [float(cell) for cell in rows[0].split(",")]
    assert read(tmp_path, scale=(0.0, 100.0)).textures[0].rated.mean.tolist() == values
    means = read(tmp_path, scale=(0.0, 10.0)).textures[0].rated.mean
    np.testing.assert_allclose(means, [10 * value for value in values])


@pytest.mark.needs("torch", "skimage")
def test_one_rating_above_ten_is_enough_for_0_to_100(tmp_path):
    folder_of(tmp_path, HEADER, "T1,x,y,1,7,3,4", "T2,x,y,2,5,1,60")
    assert read(tmp_path).textures[0].rated.mean.tolist() == [1, 7, 3, 4]


@pytest.mark.needs("torch", "skimage")
@pytest.mark.parametrize("separator", [";", "\t"])
def test_semicolons_and_tabs_separate_too_and_commas_are_decimal_then(tmp_path, separator):
    """As a spreadsheet saves a CSV where numbers have decimal commas; a comma in a name stays one."""
    header = f"{HEADER},Rough-Smooth.sd,raters".replace(",", separator)
    rows = ("T1|oak, oiled|wood|20,5|30|60.25|5|1,5|12", "T2|felt|fabric|80|10|40|70||")
    folder_of(tmp_path, header, *(row.replace("|", separator) for row in rows))
    one, other = read(tmp_path).textures
    assert one.label == "oak, oiled"
    assert one.rated.mean.tolist() == [20.5, 30, 60.25, 5]
    assert (one.rated.sd[0], one.rated.raters, other.rated.raters) == (1.5, 12, 0)
    folder_of(tmp_path, header, rows[0].replace("|", separator).replace("20,5", "1.020,5"))
    with pytest.raises(MaterialError, match=r"line 2: Rough-Smooth is '1.020.5', a finite number is expected"):
        read(tmp_path)


def test_where_commas_separate_none_is_decimal(tmp_path):
    folder_of(tmp_path, HEADER, 'T1,oak,wood,"20,5",30,60,5')
    with pytest.raises(MaterialError, match="line 2: Rough-Smooth is '20,5', a finite number is expected"):
        read(tmp_path)
    folder_of(tmp_path, HEADER, ROWS[0].replace(",", ";"))
    with pytest.raises(MaterialError, match="line 2: 1 cell found, 7 columns are expected"):
        read(tmp_path)


def test_a_table_in_other_bytes_is_refused(tmp_path):
    folder_of(tmp_path, HEADER, ROWS[0])
    (tmp_path / "ratings.csv").write_bytes(b"id,\xff\n")
    with pytest.raises(MaterialError, match="byte 3 is not UTF-8"):
        read(tmp_path)
