"""Who is in an export: nobody who withdrew or declined, pseudonyms alone, and simulated people marked as such."""

from __future__ import annotations

import json

import pytest

from palpate.analysis.exporting.demographics import ParticipantTable, without_small_groups
from palpate.analysis.exporting.tabular import Column, ExportRefused
from palpate.analysis.ratings.dataset import DataRefused
from palpate.studies.collecting.collect import collect, open_database
from tests.analysis.exporting.labs import RECORDED, answering, exported, lab_of, read_rows, rewritten
from tests.commands_for_tests import run_command
from tests.studies.collecting.test_collect_forms import ran

LEXICON = RECORDED / "ten/door_lexicon_P001_s1.sqlite"


def session(lab, who, change=lambda kind, body: body, **how):
    """A session of another participant, recorded with real devices and a person, as far as its header says."""
    header = {"participant": who, "row": 0, "rig": {"kind": "live"}, **how.pop("header", {})}
    return rewritten(LEXICON, lab / f"sessions/door_lexicon_{who}_s1.sqlite", change, header, **how)


def test_people_who_withdrew_are_never_exported(tmp_path):
    lab = tmp_path / "lab"
    assert run_command("init", lab)[0] == 0
    for _ in range(2):
        assert run_command("participants", "add", "--lab", lab)[0] == 0
    for path in sorted(RECORDED.glob("sessions/doors_small_P00[12]_s1.sqlite")):
        (lab / "sessions" / path.name).write_bytes(path.read_bytes())
    assert run_command("participants", "withdraw", "P001", "--why", "asked to", "--lab", lab)[0] == 0
    export = exported(lab, "doors_small", tmp_path / "out", "bids")
    assert export.participants == 1 and export.left_out == ("doors_small/P001/1: the participant withdrew",)
    everything = b"".join(path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file())
    assert b"P001" not in everything and b"P002" in everything


def test_a_database_that_marks_a_withdrawal_is_heeded_without_the_lab(tmp_path):
    url = f"sqlite:///{tmp_path / 'lab.sqlite'}"
    engine = open_database(url)
    list(collect(sorted(RECORDED.glob("sessions/doors_small_P00[12]_s1.sqlite")), engine, {"P002"}))
    engine.dispose()
    exported(tmp_path, "doors_small", tmp_path / "out", "csv", url=url)
    assert {row["participant"] for row in read_rows(tmp_path / "out/ratings.csv")} == {"P001"}


@pytest.mark.parametrize("ended_as", ["declined", "ineligible"])
def test_people_who_took_no_part_are_never_exported_whatever_is_requested(tmp_path, ended_as):
    lab = lab_of(tmp_path / "lab", "door_lexicon")

    def declining(kind, body):
        return {**body, "as": ended_as} if kind == "session_ended" else body

    rewritten(LEXICON, lab / "sessions/door_lexicon_P002_s1.sqlite", declining, {"participant": "P002"})
    exported(lab, "door_lexicon", tmp_path / "out", "csv", include_incomplete=True)
    assert [row["participant"] for row in read_rows(tmp_path / "out/participants.csv")] == ["P001"]


@pytest.mark.parametrize("free_text", [False, True])
def test_what_people_wrote_in_an_interview_leaves_the_lab_only_on_request(tmp_path, free_text):
    questions = [{"name": "felt", "text": "What did you feel?"}]
    ran(tmp_path, "matching", closing=["questionnaire", "interview"], interview=questions)
    exported(tmp_path, "toy", tmp_path / "out", "csv", free_text=free_text)
    assert ("interview" in {row["form"] for row in read_rows(tmp_path / "out/answers.csv")}) == free_text


@pytest.mark.parametrize(
    ("form", "file"), [("csv", "anchors.csv"), ("bids", "sub-P001/ses-01/beh/*references_beh.tsv")]
)
def test_references_have_a_table_of_their_own(tmp_path, form, file):
    anchors = {"stimuli": [{"id": "A", "label": "This is 0.", "attribute": "Soft", "value": 0}]}
    ran(tmp_path, "matching", anchors=anchors)
    exported(tmp_path, "toy", tmp_path / "out", form)
    [path] = (tmp_path / "out").glob(file)
    lines = path.read_text(encoding="utf-8").splitlines()
    assert (
        len(lines) == 2
        and {"label", "felt"} <= set(lines[0].replace("\t", ",").split(","))
        and "This is 0." in lines[1]
    )


def test_interrupted_sessions_come_only_on_request_and_say_so(tmp_path):
    lab = lab_of(tmp_path / "lab", "door_lexicon")
    rewritten(LEXICON, lab / "sessions/door_lexicon_P002_s1.sqlite", header={"participant": "P002"}, upto=20)
    exported(lab, "door_lexicon", tmp_path / "out", "bids")
    assert "P002, session 1: interrupted after" in (tmp_path / "out/README.md").read_text()
    exported(lab, "door_lexicon", tmp_path / "all", "csv", include_incomplete=True)
    assert [row["status"] for row in read_rows(tmp_path / "all/sessions.csv")] == ["complete", "interrupted"]
    assert {row["status"] for row in read_rows(tmp_path / "all/trials.csv")} >= {"answered", "not met"}


def test_ages_are_capped_and_answers_are_codes(tmp_path):
    lab = tmp_path / "lab"
    session(lab, "P001", answering(age=93, handedness=None))
    for fmt, file in (
        ("csv", "participants.csv"),
        ("psych-ds", "data/study-doorlexicon_description-participants_data.csv"),
    ):
        exported(lab, "door_lexicon", tmp_path / fmt, fmt)
        [row] = read_rows(tmp_path / fmt / file)
        assert (row["age"], row["handedness"], row["simulated"]) == ("89", "", "false")
    assert {row["value"] for row in read_rows(tmp_path / "csv/answers.csv")} == {"89", ""}
    assert "93" not in (tmp_path / "csv/answers.csv").read_text()


def test_simulated_and_real_people_are_not_mixed_and_simulated_ones_are_marked(tmp_path):
    lab = lab_of(tmp_path / "lab", "door_lexicon")
    session(lab, "P002")
    with pytest.raises(DataRefused, match="--real or --simulated"):
        exported(lab, "door_lexicon", tmp_path / "out", "bids")
    exported(lab, "door_lexicon", tmp_path / "real", "bids", simulated=False)
    exported(lab, "door_lexicon", tmp_path / "made", "bids", simulated=True)
    real, simulated = (
        json.loads((tmp_path / name / "dataset_description.json").read_text()) for name in ("real", "made")
    )
    assert (real["Simulated"], simulated["Simulated"]) == (False, True) and simulated["Name"] != real["Name"]
    assert "**Simulated data" in (tmp_path / "made/README.md").read_text()
    assert "**Simulated data" not in (tmp_path / "real/README.md").read_text()


def test_recordings_need_the_ledgers_and_the_very_ones_that_were_collected(tmp_path):
    url = f"sqlite:///{tmp_path / 'lab.sqlite'}"
    engine = open_database(url)
    list(collect([RECORDED / "ten/texture_capture_P001_s1.sqlite"], engine))
    engine.dispose()
    with pytest.raises(ExportRefused, match=r"not there; name its lab with --lab, or leave recordings out"):
        exported(tmp_path, "texture_capture", tmp_path / "out", "bids", url=url)
    exported(tmp_path, "texture_capture", tmp_path / "out", "bids", url=url, recordings=False)
    assert not list((tmp_path / "out").rglob("*physio*")) and "left out" in (tmp_path / "out/README.md").read_text()
    rewritten(RECORDED / "ten/texture_capture_P001_s1.sqlite", tmp_path / "sessions/texture_capture_P001_s1.sqlite",
              answering(age=44))  # fmt: skip
    with pytest.raises(ExportRefused, match="not the session that was collected"):
        exported(tmp_path, "texture_capture", tmp_path / "out2", "bids", url=url)


QUESTIONS = {"age": ("answer_age", "number"), "hand": ("hand", "choice"), "remark": ("remark", "text")}


def answered(**columns):
    count = len(next(iter(columns.values())))
    rows = tuple(
        {"participant": f"P{n:03d}", **{name: values[n] for name, values in columns.items()}} for n in range(count)
    )
    return ParticipantTable(
        (Column("answer_age", "Age."), Column("hand", "Hand."), Column("remark", "Said.")), rows, QUESTIONS
    )


def shown(people, column, least=3):
    return [row.get(column) for row in without_small_groups(people, least)[0].rows]


@pytest.mark.parametrize(
    ("hands", "expected"),
    [
        ("rrrrl", "     "),  # the one empty cell would tell: all are withheld
        ("rrrrll", "      "),
        ("rrrrlll", "rrrrlll"),
        ("rrrrrlllab", "rrrrr     "),  # a and b are two: the three of l go with them
        ("rrrrrlllabc", "rrrrrlll   "),
        ("rr", "  "),
    ],
)
def test_a_choice_of_few_is_withheld_and_does_not_show_by_what_is_left(hands, expected):
    result = shown(answered(hand=list(hands)), "hand")
    assert result == [None if answer == " " else answer for answer in expected]


@pytest.mark.parametrize(
    ("ages", "expected"),
    [
        ([20, 40, 21, 41, 22, 42], [21.0, 41.0, 21.0, 41.0, 21.0, 41.0]),
        ([20, 30, 40, 50], [35.0] * 4),
        ([20, 30], [None, None]),
        ([25, 25, 25], [25.0] * 3),
        ([20, None, 30, 40], [30.0, None, 30.0, 30.0]),
    ],
)
def test_numbers_are_means_of_people_of_like_number(ages, expected):
    people = answered(answer_age=ages)
    assert shown(people, "answer_age") == expected and shown(people, "answer_age", 1) == ages


def test_what_was_withheld_is_reported_and_words_stay():
    people = answered(answer_age=[20, 30, 40], hand=list("rrl"), remark=["cook", None, "nurse"])
    remaining, notes = without_small_groups(people, 3)
    assert [row["remark"] for row in remaining.rows] == ["cook", None, "nurse"]
    assert notes[1] == "hand: answers of fewer than 3 participants are withheld (empty)."
    assert remaining.columns[0].description == "Age. Each number is the mean of at least 3 participants of like age."
    assert without_small_groups(people, 1) == (people, ())


@pytest.mark.parametrize(("rig", "ages"), [("live", {"40.0"}), ("simulated", {"20", "40", "60"})])
def test_real_people_are_protected_in_every_table_unless_requested(tmp_path, rig, ages):
    for who, age in (("P001", 20), ("P002", 40), ("P003", 60)):
        session(tmp_path, who, answering(age=age), header={"rig": {"kind": rig}})
    export = exported(tmp_path, "door_lexicon", tmp_path / "out", "csv", least_people=3)
    assert {float(row["age"]) for row in read_rows(tmp_path / "out/participants.csv")} == set(map(float, ages))
    age_rows = [row for row in read_rows(tmp_path / "out/answers.csv") if row["item"] == "age"]
    assert (
        {float(row["value_number"]) for row in age_rows}
        == {float(row["value"]) for row in age_rows}
        == set(map(float, ages))
    )
    note = "age: each number is the mean of at least 3 participants of like age."
    assert (note in export.withheld) == (rig == "live") == (note in (tmp_path / "out/README.md").read_text())
    exported(tmp_path, "door_lexicon", tmp_path / "all", "csv")
    assert {float(row["age"]) for row in read_rows(tmp_path / "all/participants.csv")} == {20, 40, 60}
