"""What says who somebody is, is found; what does not, is left in peace."""

from __future__ import annotations

import pytest

from palpate.analysis.exporting.guard import Guard, identifying_word
from palpate.analysis.exporting.tabular import ExportRefused
from palpate.studies.participants.identities import Identity
from palpate.studies.sessions.record import read
from tests.analysis.exporting.labs import RECORDED, answering, exported, rewritten

LEXICON = RECORDED / "ten/door_lexicon_P001_s1.sqlite"
WHO = (
    "name|Full Name|participantName|email|e_mail|Phone|home-address|dateOfBirth|ip|IPAddress|gps|studentId|"
    "Geburtsdatum|Anschrift|nom|Téléphone|te\u0301le\u0301phone|apellidos|nascita|имя|姓名|电话|住所|이름|연락처|फ़ोन"
)
WHAT = (
    "participant|session|stimulus|attribute|value|age|gender|handedness|label|class|file|texture|roughness_N|"
    "filename|nominal|tip_speed|birch|strip|phonetic|named"
)
TELLING = (
    "write to mina.kim@lab.ac.kr|mina (at) lab.ac.kr|ｍｉｎａ＠lab.kr|010-1234-5678|+82 10 1234 5678|"
    "(030) 1234567-8|900101-1234567|12345678|born 1990-05-17|17.05.1990|5/17/90|1990년 5월 17일|17 May 1990|"
    "May 17, 1990|192.168.10.23|fe80:0:0:0:200:f8ff:fe21:67cf|see https://example.org/me"
)
HARMLESS = (
    "smooth|33.5973|-16.9012|0.12345678901|about 3.5 N at 20 deg|T01|7/10|1, 2, 3, 4, 5|like new|2 of 3|1990|"
    "stepwise; rough (at first)|5 - 6 seconds|Cheerful, rhythmical|v0.1.0|90 %"
)


@pytest.mark.parametrize("name", WHO.split("|"))
def test_columns_about_who_somebody_is_are_known_in_many_languages(name):
    assert identifying_word(name)


@pytest.mark.parametrize("name", WHAT.split("|"))
def test_other_columns_are_not(name):
    assert identifying_word(name) is None


@pytest.mark.parametrize("text", TELLING.split("|"))
def test_texts_that_could_name_somebody_are_found(text):
    assert Guard().looks(text)


@pytest.mark.parametrize("text", HARMLESS.split("|"))
def test_other_texts_are_not(text):
    assert Guard().looks(text) is None


def test_names_and_contacts_that_the_lab_keeps_are_looked_for():
    guard = Guard({"P001": Identity("Rich Smooth", "room 7 on floor 3")})
    assert guard.looks("like rich SMOOTH himself") and guard.looks("(Room 7 on floor 3)")
    assert guard.looks("rich") is None and guard.looks("smooth") is None


def test_a_refusal_names_file_column_and_row_and_not_the_text(tmp_path):
    lab = tmp_path / "lab"
    written = answering(words=["heavy", "call 010-1234-5678"])
    rewritten(LEXICON, lab / "sessions/door_lexicon_P001_s1.sqlite", written)
    with pytest.raises(ExportRefused, match=r"words\.csv: row 2, column 'word'.* telephone.*--without word") as refused:
        exported(lab, "door_lexicon", tmp_path / "out", "csv")
    assert "1234" not in str(refused.value) and list(tmp_path.iterdir()) == [lab]
    result = exported(lab, "door_lexicon", tmp_path / "out", "csv", redact=True)
    text = (tmp_path / "out/words.csv").read_text()
    assert "heavy" in text and "[redacted]" in text and "5678" not in text and len(result.redacted) == 6
    assert "words.csv: row 2" in (tmp_path / "out/README.md").read_text()


@pytest.mark.parametrize(
    "fmt", ["bids", "psych-ds", "csv", pytest.param("parquet", marks=pytest.mark.needs("pyarrow"))]
)
def test_answers_about_oneself_are_checked_and_can_be_left_out(fmt, tmp_path):
    lab = tmp_path / "lab"
    rewritten(LEXICON, lab / "sessions/door_lexicon_P001_s1.sqlite", answering(remark="I am mina.kim@lab.ac.kr"))
    with pytest.raises(ExportRefused, match=r"participants.*row 1, column 'remark'.*e-mail.*--without remark"):
        exported(lab, "door_lexicon", tmp_path / "out", fmt)
    exported(lab, "door_lexicon", tmp_path / "out", fmt, without=["remark"])
    everything = b"".join(path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file())
    assert b"mina.kim" not in everything and (fmt == "parquet" or b"remark" not in everything)


def test_a_question_that_asks_who_somebody_is_is_refused(tmp_path):
    lab = tmp_path / "lab"
    question = {"name": "phone", "text": "Phone?", "kind": "text", "levels": [], "unit": None, "optional": True}

    def change(kind, body):
        if kind == "request" and body.get("form") == "demographics":
            return {**body, "items": ["phone"]}
        return {**body, "answers": {"phone": "none"}} if "age" in body.get("answers", {}) else body

    header = {"lab_forms": {"consent": "?", "questions": [{**question, "low": None, "high": None}]}}
    rewritten(LEXICON, lab / "sessions/door_lexicon_P001_s1.sqlite", change, header)
    with pytest.raises(ExportRefused, match=r"participants\.tsv: column 'phone'.*--without phone"):
        exported(lab, "door_lexicon", tmp_path / "out", "bids")


def test_a_stimulus_column_about_a_person_is_refused_and_leaves_the_definition_too(tmp_path):
    lab, source = tmp_path / "lab", RECORDED / "sessions/doors_small_P001_s1.sqlite"
    study = read(source).header["study"]
    for stimulus in study["stimuli"]:
        stimulus["columns"]["maker_email"] = "mina.kim@lab.ac.kr"
    rewritten(source, lab / "sessions/doors_small_P001_s1.sqlite", header={"study": study})
    with pytest.raises(ExportRefused, match=r"stimuli\.csv: column 'maker_email'.*--without maker_email"):
        exported(lab, "doors_small", tmp_path / "out", "csv")
    exported(lab, "doors_small", tmp_path / "out", "csv", without=["maker_email"])
    assert not any(b"mina.kim" in path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file())


@pytest.mark.parametrize(("name", "text"), [
    ("김미나", "저는 김미나입니다"), ("王明", "我叫王明"), ("Mina Kim", "I am Kim, Mina"), ("Mina  Kim", "mina kim!"),
])  # fmt: skip
def test_a_known_name_is_found_with_a_particle_and_with_the_surname_first(name, text):
    assert Guard({"P001": Identity(name)}).looks(text)
    assert Guard({"P001": Identity(name)}).looks("minakimono, 미나리") is None


@pytest.mark.parametrize(
    ("pseudonym", "good"), [("P001", True), ("Mina1", False), ("kim01", False), ("S20231234", False)]
)
def test_a_pseudonym_that_is_a_name_or_a_number_of_identity_is_refused(pseudonym, good):
    guard = Guard({pseudonym: Identity("Mina Kim")})
    if good:
        guard.demand_pseudonyms([pseudonym])
        return
    with pytest.raises(ExportRefused, match="participant 1 of the export: the pseudonym itself") as refused:
        guard.demand_pseudonyms([pseudonym])
    assert pseudonym not in str(refused.value)


@pytest.mark.parametrize(
    "fmt", ["bids", "psych-ds", "csv", pytest.param("parquet", marks=pytest.mark.needs("pyarrow"))]
)
def test_an_identity_number_answered_as_a_number_is_refused_in_every_format(fmt, tmp_path):
    lab = tmp_path / "lab"
    question = {"name": "registered", "text": "Number?", "kind": "number", "levels": [], "unit": None, "optional": True}

    def change(kind, body):
        if kind == "request" and body.get("form") == "demographics":
            return {**body, "items": ["registered"]}
        return {**body, "answers": {"registered": 20231234}} if "age" in body.get("answers", {}) else body

    header = {"lab_forms": {"consent": "?", "questions": [{**question, "low": 0, "high": 1e9}]}}
    rewritten(LEXICON, lab / "sessions/door_lexicon_P001_s1.sqlite", change, header)
    with pytest.raises(ExportRefused, match=r"participants.*row 1, column 'registered'.*--without registered"):
        exported(lab, "door_lexicon", tmp_path / "out", fmt)
    exported(lab, "door_lexicon", tmp_path / "out", fmt, redact=True)
    everything = b"".join(path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file())
    assert b"20231234" not in everything


def test_the_name_of_the_labs_folder_stays_in_the_lab(tmp_path):
    lab = tmp_path / "mina_kims_lab"
    source = RECORDED / "ten/door_authoring_P001_s1.sqlite"
    study = {**read(source).header["study"], "study": "mine"}
    rewritten(source, lab / "sessions/mine_P001_s1.sqlite", header={"study": study})
    exported(lab, "mine", tmp_path / "out", "csv")
    assert not any(b"mina_kims" in path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file())
