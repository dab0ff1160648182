import json
import subprocess
import sys

import pytest
from click.testing import CliRunner

from palpate.studies.participants.commands import init, participants
from tests.studies.participants.labs import record_session

TOY = """\
study: toy
task: slider_rating
stimuli: [A, B, C, D]
attributes: [[Soft, Hard]]
scale: {from: -10, to: 10, step: 1}
order: {design: williams}
"""


@pytest.fixture
def run(tmp_path):
    """Return a function that runs a verb in a lab with the studies toy and other, and returns output or error."""
    lab = tmp_path / "lab"
    assert CliRunner().invoke(init, [str(lab)]).exit_code == 0
    for name in ("toy", "other"):
        (lab / "studies" / name).mkdir()
        (lab / "studies" / name / "study.yaml").write_text(TOY.replace("study: toy", f"study: {name}"))

    def call(*arguments, status=0):
        done = CliRunner().invoke(participants, [*arguments, "--lab", str(lab)])
        if isinstance(done.exception, ValueError):
            assert status == 2, done.exception
            return str(done.exception)
        assert done.exit_code == status, done.output
        return done.output

    call.lab = lab
    return call


def test_the_life_of_a_lab(run):
    assert run("add", "--name", "Kim Hana", "--consented", "2026-03-31") == "P001\n"
    assert json.loads(run("add", "--json")) == {"participant": "P002"}
    assert run("add", "--pseudonym", "P007") == "P007\n"
    assert run("allocate", "toy", "P001") == "P001 has row 0 of toy\n"
    assert json.loads(run("allocate", "toy", "P002", "--json"))["row"] == 1
    assert run("allocate", "toy", "P007", "--row", "5") == "P007 has row 5 of toy\n"
    run("allocate", "other", "P001")
    assert "row 1 of toy is on offer again" in run("release", "toy", "P002", "--why", "ill")
    text = run("balance", "toy")
    assert text.startswith("group all: 2 sequences of 4 items: not balanced (yet).")
    assert "row   5  P007     active" in text and "row   1  on offer, given up by P002" in text
    assert text.endswith("next: row 1\n50 % (1 of 2) also took part in other\n")
    text = run("withdraw", "P001", "--why", "on request")
    assert "their identity is erased" in text and "row 0 of other is on offer again" in text
    assert run("add") == "P003\n"
    assert run("allocate", "toy", "P003", "--replaces", "P001") == "P003 has row 0 of toy\n"
    assert "row   0  P003     active, inherited from P001" in run("balance", "toy")
    assert run("overlap", "toy") == "nobody has taken part in any other study of this lab\n"
    assert "3 participants in" in run("export") and "sub-P001" not in (run.lab / "participants.tsv").read_text()


def test_names_are_shown_when_asked_for_and_never_otherwise(run):
    run("add", "--name", "Kim Hana", "--contact", "hana@example.org", "--note", "prefers mornings")
    run("identify", "P001", "--contact", "new@example.org")
    run("allocate", "toy", "P001")
    printed = "".join(
        [run("list"), run("list", "--json"), run("balance", "toy"), run("balance", "toy", "--json"), run("export"),
         run("overlap", "toy", "--json"), run("export", "--json"), run("withdraw", "--help")]
    )  # fmt: skip
    shown = run("list", "--identities")
    for secret in ("Kim Hana", "new@example.org", "prefers mornings"):
        assert secret in shown and secret not in printed
        holding = [path for path in run.lab.rglob("*") if path.is_file() and secret.encode() in path.read_bytes()]
        assert holding == [run.lab / "private" / "identities.sqlite"]
    assert run("list", "--identities", "--json", status=2).count("names go into no JSON") == 1


def test_the_list_says_who_has_which_rows_and_sessions(run):
    run("add")
    run("add")
    run("allocate", "toy", "P001")
    record_session(run.lab, "P001")
    record_session(run.lab, "P005", row=(None, 4))
    rows = json.loads(run("list", "--json"))
    assert [(row["participant"], row["status"], row["sessions"]) for row in rows] == [
        ("P001", "active", ["toy_P001_s1.sqlite"]), ("P002", "active", []), ("P005", "session", ["toy_P005_s1.sqlite"]),
    ]  # fmt: skip
    assert rows[0]["studies"] == [{"study": "toy", "group": None, "row": 0, "status": "active", "replaces": None}]
    assert [row["participant"] for row in json.loads(run("list", "--study", "toy", "--json"))] == ["P001"]
    assert "P001     active     1 session\n" in run("list")


def test_balance_as_json_has_counts_and_what_is_on_offer(run):
    for _ in range(4):
        run("allocate", "toy", run("add").strip())
    [group] = json.loads(run("balance", "toy", "--json"))["groups"]
    assert group["balanced"] is True and group["position_range"] == group["carry_over_range"] == [1, 1]
    assert [row["participant"] for row in group["rows"]] == ["P001", "P002", "P003", "P004"]
    assert (group["on_offer"], group["next_row"]) == ([], 4)
    [empty] = json.loads(run("balance", "other", "--json"))["groups"]
    assert empty["balanced"] is False and "nobody has a row yet" in run("balance", "other")


@pytest.mark.parametrize(
    ("arguments", "mistake"),
    [
        (["allocate", "toy", "P009"], "palpate participants add --pseudonym P009 --lab"),
        (["allocate", "tyo", "P001"], "no study is called 'tyo'; did you mean 'toy'?"),
        (["allocate", "toy", "P002", "--replaces", "P001"], "P001 still holds row 0 of toy"),
        (["allocate", "toy", "P002", "--row", "0"], "row 0 of toy is P001's"),
        (["identify", "P009", "--name", "x"], "P009 is not known"),
        (["add", "--pseudonym", "Hana"], "a pseudonym as P001 is expected"),
        (["add", "--consented", "yesterday"], "consented: found 'yesterday'"),
        (["withdraw", "P009", "--why", "-"], "P009 is not known"),
        (["release", "toy", "P001", "--why", " "], "a reason is expected"),
        (["list", "--study", "tyo"], "no study is called 'tyo'; did you mean 'toy'?"),
    ],
)
def test_a_mistake_is_reported_and_changes_nothing(run, arguments, mistake):
    run("allocate", "toy", run("add").strip())
    run("add")
    before = run("list", "--json")
    assert mistake in run(*arguments, status=2)
    assert run("list", "--json") == before


def test_a_missing_option_is_a_mistake_of_use(run):
    run("add")
    assert "nothing to write down: give --name" in run("identify", "P001", status=2)
    assert "--why" in run("withdraw", "P001", status=2)


def test_nobody_is_added_while_the_store_of_names_is_open_to_others(run):
    run("add", "--name", "Kim Hana")
    (run.lab / "private").chmod(0o755)
    assert "chmod 700" in run("add", "--name", "Lee", status=2)
    assert len(json.loads(run("list", "--json"))) == 1


def test_every_verb_reports_a_folder_that_is_no_lab(tmp_path):
    verbs = (["add"], ["list"], ["withdraw", "P001", "--why", "-"], ["allocate", "door_ratings", "P001"], ["export"],
             ["release", "door_ratings", "P001", "--why", "-"], ["balance", "door_ratings"],
             ["identify", "P1", "--name", "x"], ["overlap", "door_ratings"])  # fmt: skip
    assert {verb[0] for verb in verbs} == set(participants.commands)
    for verb in verbs:
        done = CliRunner().invoke(participants, [*verb, "--lab", str(tmp_path)])
        assert "is not a lab: it holds no participants.json; make it one with: palpate init" in str(done.exception)
    assert list(tmp_path.iterdir()) == []


def test_init_says_what_is_still_to_do(tmp_path):
    text = CliRunner().invoke(init, [str(tmp_path / "lab")]).output
    assert "consent.md: 9 [blanks] to fill in" in text and "then: palpate participants add --lab" in text
    again = CliRunner().invoke(init, [str(tmp_path / "lab")])
    assert "is a lab already" in str(again.exception)


def test_help_imports_nothing_heavy():
    code = (
        "import sys, palpate.studies.participants.commands\n"
        "print(sorted({'sqlalchemy', 'pydantic', 'numpy', 'pandas', 'yaml'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
