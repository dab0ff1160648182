import hashlib
import shutil

import pytest

from palpate.protocols.reading import StudyError
from palpate.protocols.yaml_text import YamlError
from palpate.studies.catalogue import SHIPPED, find, names, read_study
from palpate.studies.participants.row_assignment import AllocationError, allocate
from tests.protocols.studies_for_tests import toy
from tests.studies.shipped import ALL

STUDY = """\
study: mine
task: slider_rating
stimuli: stimuli.csv
attributes: [[Soft, Hard]]
scale: {from: 0, to: 100}
order: {design: latin}
"""


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "studies" / "mine"
    folder.mkdir(parents=True)
    (folder / "study.yaml").write_text(STUDY)
    (folder / "stimuli.csv").write_text("id,file\na,a.csv\nb,\n")
    (folder / "a.csv").write_text("1,2\n")
    return folder


def test_a_study_is_found_by_name_folder_and_file(tmp_path, folder):
    file = folder / "study.yaml"
    assert find("mine", tmp_path) == find(str(folder), tmp_path) == find(str(file), tmp_path) == file
    assert set(names(tmp_path)) == {"mine", "texture_photos", *ALL}
    study_files = read_study(file)
    assert study_files.folder == folder
    assert study_files.study.stimuli[0].sha256 == hashlib.sha256(b"1,2\n").hexdigest()
    assert study_files.study.stimuli[1].sha256 is None


def test_the_labs_own_study_goes_before_a_shipped_one(tmp_path, folder):
    shutil.copytree(folder, tmp_path / "studies" / "door_ratings")
    assert find("door_ratings", tmp_path).is_relative_to(tmp_path)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("door_rating", "no study is called 'door_rating'; did you mean 'door_ratings'?"),
        ("nowhere/study.yaml", "nowhere/study.yaml: no such study file"),
    ],
)
def test_an_unknown_study_names_the_nearest(tmp_path, name, message):
    with pytest.raises(StudyError) as caught:
        find(name, tmp_path)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("stimuli.csv", None, r"study.yaml: line 3: stimuli: no file 'stimuli.csv' in .*; known: a.csv"),
        ("a.csv", None, r"stimuli.csv: line 2: the stimulus file 'a.csv' is not in"),
        ("stimuli.csv", b"id,file\na,../../out.csv\n", "line 2: '../../out.csv' leads out of the study's folder"),
        ("stimuli.csv", b"", "the file is empty; a header with the column id"),
        ("stimuli.csv", b"name\na\n", "line 1: no column 'id'; found name"),
        ("stimuli.csv", b"id,file\na,a\0.csv\n", "is not a file name"),
        ("stimuli.csv", b"id,x,x\na,1,2\n", "every column needs its own name"),
        ("stimuli.csv", b"id,x,\na,1,2\n", "every column needs its own name"),
        ("stimuli.csv", b"id,x\na\n", "line 2: 1 cells, 2 columns are expected"),
        ("stimuli.csv", b"id,x\na,\xff\n", "byte 7 is not UTF-8"),
        ("stimuli.csv", b'id,x\na,"1"2"\n', "line 2: "),
        ("stimuli.csv", b"id\n" + b"x\n" * 6000, "more than 5000 stimuli"),
        ("stimuli.csv", b"id\na\na\n", "the stimulus id 'a' appears twice"),
        ("study.yaml", STUDY.replace("stimuli.csv", "12").encode(), "stimuli: found 12, expected the name of a CSV"),
        ("study.yaml", STUDY.replace("stimuli.csv", "../x.csv").encode(), "leads out of the study's folder"),
        ("study.yaml", b"study: caf\xe9\n", "is not UTF-8"),
        ("study.yaml", STUDY.replace("stimuli: stimuli.csv\n", "").encode(), "stimuli: this key is required"),
    ],
)
def test_a_bad_study_folder_is_refused(folder, file, content, message):
    if content is None:
        (folder / file).unlink()
    else:
        (folder / file).write_bytes(content)
    before = sorted(folder.iterdir())
    with pytest.raises((StudyError, YamlError), match=message):
        read_study(folder / "study.yaml")
    assert sorted(folder.iterdir()) == before


def test_a_study_file_that_cannot_be_opened(tmp_path):
    (tmp_path / "study.yaml").mkdir()
    with pytest.raises(StudyError, match="cannot be read"):
        read_study(tmp_path / "study.yaml")


def test_a_study_may_list_its_stimuli_itself(folder):
    (folder / "study.yaml").write_text(STUDY.replace("stimuli.csv", "[a, b, 3]"))
    assert [s.id for s in read_study(folder / "study.yaml").study.stimuli] == ["a", "b", "3"]


def test_the_door_study_is_the_one_of_the_thesis():
    study = read_study(SHIPPED / "door_ratings" / "study.yaml").study
    assert len(study.stimuli) == 90
    assert {s.columns["car"] for s in study.stimuli_of("1")} == {"BC3", "FORD", "G90"}
    assert [len(study.stimuli_of(group)) for group in ("1", "2")] == [45, 45]
    assert sorted({s.columns["variant"] for s in study.stimuli}, key=lambda v: int(v[1:])) == [
        f"g{i}" for i in range(15)
    ]
    assert [(a.low, a.high) for a in study.attributes] == [
        ("Easy-to-pull", "Hard-to-pull"), ("Damped", "Recoiling"), ("Consistent", "Stepwise"),
        ("Pleasant", "Unpleasant"), ("New", "Old"), ("Comfort", "Discomfort"), ("Luxurious", "Cheap"),
    ]  # fmt: skip
    assert (study.scale.low, study.scale.high, study.scale.step) == (-10, 10, 1)
    assert study.rest and study.rest.every == 15 and study.order.design == "williams"
    assert {s.columns["source"] for s in study.stimuli if s.columns["car"] == "BC3"} == {"measured"}
    assert {s.columns["source"] for s in study.stimuli if s.columns["car"] != "BC3"} == {"simulated"}
    assert all(s.sha256 for s in study.stimuli)


@pytest.mark.parametrize(
    ("participant", "given", "expected"),
    [
        ("P001", {}, ("1", 0)), ("P002", {}, ("2", 0)), ("P003", {}, ("1", 1)), ("P40", {}, ("2", 19)),
        ("P001", {"group": "2"}, ("2", 0)), ("P001", {"row": 5}, ("1", 5)),
        ("Anna", {"group": "1", "row": 2}, ("1", 2)),
    ],
)  # fmt: skip
def test_a_pseudonym_says_its_group_and_row(participant, given, expected):
    study = toy(groups={"1": {"kind": ["x"]}, "2": {"kind": ["y"]}})
    who = allocate(study, participant, **given)
    assert (who.group, who.row) == expected


def test_without_groups_the_number_is_the_row():
    assert allocate(toy(), "P007").row == 6
    assert allocate(toy(), "Anna", row=3).row == 3


@pytest.mark.parametrize(
    ("participant", "message"),
    [
        ("Anna", "participant 'Anna' has no number, as P001 has; give --group and --row"),
        ("P000", "has no number"),
        ("anna@lab", "a pseudonym of a letter and up to 15 letters or digits"),
        ("", "a pseudonym"),
        ("../P001", "a pseudonym"),
        ("P001_x", "a pseudonym"),
    ],
)
def test_what_is_no_pseudonym_is_refused(participant, message):
    with pytest.raises(AllocationError, match=message):
        allocate(toy(), participant)
