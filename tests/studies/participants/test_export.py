import json

import pytest

from palpate.studies.lab import ParticipantError
from palpate.studies.participants.export import export
from palpate.studies.participants.identities import Identity, identify
from palpate.studies.participants.people import add
from palpate.studies.participants.rows import allocate_row
from palpate.studies.participants.withdrawal import withdraw
from tests.protocols.studies_for_tests import toy
from tests.studies.participants.labs import filled, record_session

HEADER = "participant_id\tage\tgender\thandedness\tdriving_experience\ttook_part_before\tstudies"
ANSWERS = {"age": 27, "gender": "F", "handedness": "right", "driving_experience": 2.5, "took_part_before": "no"}


def table(registry):
    return (registry.lab / "participants.tsv").read_text("utf-8").splitlines()


def test_everybody_stands_in_the_table_once_with_their_answers(registry):
    filled(registry, 3)
    identify(registry.lab, "P001", Identity("Kim Hana", "hana@example.org"))
    for study in ("toy", "other"):
        allocate_row(registry, toy(study=study), "P001")
    record_session(registry.lab, "P001", ANSWERS)
    record_session(registry.lab, "P002", {**ANSWERS, "age": 93.0, "gender": None}, row=(None, 1))
    record_session(registry.lab, "P007", row=(None, 2))
    done = export(registry)
    assert table(registry) == [
        HEADER,
        "sub-P001\t27\tF\tright\t2.5\tno\tother;toy",
        "sub-P002\t89\tn/a\tright\t2.5\tno\ttoy",
        "sub-P003\tn/a\tn/a\tn/a\tn/a\tn/a\tn/a",
        "sub-P007\tn/a\tn/a\tn/a\tn/a\tn/a\ttoy",
    ]
    assert done.participants == ("P001", "P002", "P003", "P007")
    before = table(registry)
    export(registry)
    assert table(registry) == before


def test_the_latest_answer_counts_and_silence_takes_nothing_back(home):
    add(home)
    record_session(home.lab, "P001", {"age": 29, "gender": None}, at="2027-05-01T00:00:00+00:00", number=1)
    record_session(home.lab, "P001", {"age": 27, "gender": "F"}, at="2026-05-01T00:00:00+00:00", number=2)
    export(home)
    assert table(home)[1].startswith("sub-P001\t29\tF\t")


def test_simulated_people_are_nobody(home):
    add(home)
    record_session(home.lab, "P001", ANSWERS, kind="simulated")
    record_session(home.lab, "P002", ANSWERS, kind="simulated", row=(None, 1))
    assert export(home).simulated == ("toy_P001_s1.sqlite", "toy_P002_s1.sqlite")
    assert table(home)[1:] == ["sub-P001" + "\tn/a" * 6]
    assert export(home, with_simulated=True).participants == ("P001", "P002")
    assert table(home)[2].startswith("sub-P002\t27\tF")


def test_a_simulated_session_that_asks_is_read_as_a_real_one(home):
    from palpate.studies.launching.launch import plans_of
    from palpate.studies.sessions import session
    from palpate.studies.simulation.rig import simulated

    study = toy(opening=["demographics"])
    [plan] = plans_of(study, home.lab, ["P001"], 1, live=False)
    assert session.start(home.lab, plan, simulated(study, home.lab)).complete
    export(home, with_simulated=True)
    cells = dict(zip(HEADER.split("\t"), table(home)[1].split("\t"), strict=True))
    assert cells["participant_id"] == "sub-P001" and cells["studies"] == "toy"
    assert sum(cell != "n/a" for cell in cells.values()) > 3


def test_who_withdrew_is_left_out(home):
    filled(home, 2)
    record_session(home.lab, "P001", ANSWERS)
    withdraw(home, "P001", "-")
    assert export(home).withdrawn == ("P001",)
    assert [line.split("\t")[0] for line in table(home)[1:]] == ["sub-P002"]


def test_what_was_written_by_hand_is_kept(home):
    described = json.loads((home.lab / "participants.json").read_text("utf-8"))
    described["vision"] = {"Description": "Acuity"}
    (home.lab / "participants.json").write_text(json.dumps(described), "utf-8")
    filled(home, 2)
    (home.lab / "participants.tsv").write_text(
        "participant_id\tvision\tage\tgender\r\nsub-P002\t0.1\t40\tM\r\nsub-P099\t0.2\t41\tF\r\n", newline=""
    )
    record_session(home.lab, "P002", {"age": 41})
    export(home)
    assert table(home)[0] == HEADER + "\tvision"
    assert table(home)[2] == "sub-P002\t41\tM\tn/a\tn/a\tn/a\ttoy\t0.1"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("participant_id\temail\nsub-P001\tx\n", "line 1: a column about 'email' would identify a person"),
        ("participant_id\tshoe\nsub-P001\t42\n", "line 1: column 'shoe' is not described in participants.json"),
        ("age\tparticipant_id\n27\tsub-P001\n", "line 1: participant_id first"),
        ("participant_id\tage\tage\n", "no column twice"),
        ("participant_id\tage\nsub-P001\n", "line 2: 1 cells, 2 columns are expected"),
        ("participant_id\tage\nsub-P001\t1\n\nsub-P001\t2\n", "line 4: sub-P001 appears there twice"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_and_left_as_it_is(home, text, message):
    add(home)
    (home.lab / "participants.tsv").write_text(text)
    with pytest.raises(ParticipantError, match=message):
        export(home)
    assert (home.lab / "participants.tsv").read_text() == text
    assert [path.name for path in home.lab.glob(".*")] == []


def test_an_answer_that_the_sidecar_no_longer_describes_is_refused(home):
    add(home)
    record_session(home.lab, "P001", {"gender": "D"})
    with pytest.raises(
        ParticipantError, match=r"toy_P001_s1\.sqlite: gender = 'D': one of .*must describe every answer"
    ):
        export(home)


def test_an_identifying_column_is_refused(home):
    described = json.loads((home.lab / "participants.json").read_text("utf-8"))
    described["birth_year"] = {"Description": "Year of birth"}
    (home.lab / "participants.json").write_text(json.dumps(described), "utf-8")
    with pytest.raises(ParticipantError, match="birth_year: a column about 'birth' would identify a person"):
        export(home)


def test_a_damaged_session_is_named_and_the_rest_written(home):
    filled(home, 1)
    path = record_session(home.lab, "P001", ANSWERS)
    path.write_bytes(path.read_bytes()[:3000])
    [problem] = export(home).refused
    assert "toy_P001_s1.sqlite" in problem and len(table(home)) == 2


def test_a_free_text_cannot_break_the_table(home):
    described = json.loads((home.lab / "participants.json").read_text("utf-8"))
    described["hobby"] = {"Question": "What do you like?"}
    (home.lab / "participants.json").write_text(json.dumps(described), "utf-8")
    add(home)
    record_session(home.lab, "P001", {"hobby": "tabs\tand\nlines\u2028"})
    export(home)
    assert table(home)[1].split("\t")[-1] == "tabs and lines"
