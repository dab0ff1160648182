"""A study that puts stimuli in order, through every command: check, plan, run, resume, replay, collect, export."""

import csv
import json
import sqlite3
from contextlib import closing

import pytest

from palpate.command_line import _status
from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import read_study
from palpate.studies.console.status import status_of
from palpate.studies.console.words import doing, where
from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.record import read
from palpate.studies.sessions.session_files import ledger_path

STUDY = """study: in_order
title: Textures in order of roughness
task: ranking
stimuli: stimuli.csv
attributes: [{low: smooth, high: rough, explanation: How strongly it scratches.}]
settings: {again: true}
order: {design: williams, within: block, blocks: {by: kind}}
practice: {stimuli: [P1, C1]}
navigation: back_and_forward
needs: [samples]
simulation: {latents: {smooth: {grit: 4.0}}, noise_sd: 1.0, revise_rate: 0.2}
"""
STIMULI = "id,kind,grit,material\nP1,paper,1,P60\nP2,paper,2,P120\nP3,paper,3,P240\nC1,cloth,1,linen\nC2,cloth,2,wool\n"
AT = {"at": "2026-01-01T00:00:00+00:00"}


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A lab in which three simulated participants put the stimuli in order."""
    lab = tmp_path_factory.mktemp("lab")
    assert _status(["init", str(lab)]) == 0
    folder = lab / "studies" / "in_order"
    folder.mkdir(parents=True)
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    (folder / "stimuli.csv").write_text(STIMULI, encoding="utf-8")
    for command in (["run", "in_order", "--participant", "P001..P003", "--simulate"], ["collect"]):
        assert _status([*command, "--lab", str(lab)]) == 0
    return lab


@pytest.fixture
def run(lab, capsys):
    """Call a command in the lab; its exit code and what it prints."""

    def call(*words):
        capsys.readouterr()
        status = _status([*words, "--lab", str(lab)])
        return status, "".join(capsys.readouterr())

    return call


def test_the_file_is_checked_and_its_sets_are_listed(run):
    status, text = run("check", "in_order")
    assert status == 0 and "5 stimuli; group all: 2 trials" in text and "an order from smooth to rough" in text
    listed = [line for line in run("plan", "in_order")[1].splitlines() if line[:4].strip().isdigit()]
    assert listed == ["   1  practice   P1, C1", "   2  cloth      C1, C2", "   3  paper      P1, P3, P2"]
    trials = json.loads(run("plan", "in_order", "--json")[1])["trials"]
    assert trials[1] == {"trial": 2, "block": "cloth", "stimulus": "C1", "stimuli": ["C1", "C2"]}


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ("settings: {agian: true}", "settings.agian: unknown key"),
        ("settings: {again: perhaps}", "settings.again: found 'perhaps'"),
        ("settings: []", "settings: keys and values are expected"),
    ],
)
def test_a_wrong_setting_is_named_with_its_line(lab, run, wrong, says):
    folder = lab / "studies" / "wrong"
    folder.mkdir(exist_ok=True)
    text = STUDY.replace("settings: {again: true}", wrong).replace("in_order", "wrong")
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    (folder / "stimuli.csv").write_text(STIMULI, encoding="utf-8")
    status, text = run("check", "wrong")
    assert status != 0 and f"line 6: {says}" in text, text


def test_sessions_replay_and_orders_have_a_table_of_their_own(lab, run):
    assert run("replay")[0] == 0
    with closing(sqlite3.connect(lab / "lab.sqlite")) as file:
        rows = file.execute(
            "SELECT participant, trial, group_concat(rank), count(*), max(set_size) FROM"
            " (SELECT * FROM rankings WHERE counts ORDER BY rank) GROUP BY participant, trial"
        ).fetchall()
    sizes = {(participant, trial): size for participant, trial, _, size, _ in rows}
    assert len(sizes) == 9 and sorted(sizes.values()) == [2] * 6 + [3] * 3
    assert all(ranks == ",".join(map(str, range(1, size + 1))) and size == of for _, _, ranks, size, of in rows)


@pytest.mark.parametrize("form", ["csv", "bids", "psych-ds"])
def test_orders_are_exported_with_what_their_columns_mean(run, tmp_path, form):
    status, _ = run("export", "in_order", "--to", str(tmp_path / "out"), f"--{form}")
    assert status == 0
    name = {"csv": "rankings.csv", "bids": "sub-P001*_beh.tsv", "psych-ds": "*rankings_data.csv"}[form]
    [file] = (tmp_path / "out").rglob(name)
    lines = file.read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(lines, delimiter="\t" if form == "bids" else ","))
    of_paper = {row["stimulus"]: row["rank"] for row in rows if row["block"] == "paper" and row["counts"] == "true"}
    assert sorted(of_paper) == ["P1", "P2", "P3"] and set(of_paper.values()) == {"1", "2", "3"}
    metadata = "".join(
        path.read_text("utf-8") for path in (tmp_path / "out").rglob("*") if path.suffix in (".json", ".csv")
    )
    assert "The place in the order: 1 at the low end of the attribute." in metadata


def test_orders_are_not_counted_as_ratings(run):
    for verb in ("analyse", "report"):
        status, text = run(verb, "in_order")
        assert status != 0 and "gives no ratings; its answers are in the table rankings" in text


def test_killed_after_an_event_a_session_is_resumed_to_the_same_end(lab, tmp_path):
    """After every fourth one; tests/protocols/tasks/test_ranking.py has every one, in memory."""
    whole = read(ledger_path(lab, "in_order", "P001"))
    (tmp_path / "studies").symlink_to(lab / "studies")
    for cut in range(1, len(whole.events), 4):
        path = ledger_path(tmp_path, "in_order", "P001", cut)
        path.parent.mkdir(exist_ok=True)
        create(path, whole.header, AT)
        ledger = open_for_append(path, AT)
        for event in whole.events[1:cut]:
            ledger.append(event)
        ledger.connection.close()
        ledger.engine.dispose()
        ledger.lock.release()
        assert _status(["resume", str(path), "--without-wal"]) == 0
        assert read(path).events == whole.events, cut


def test_the_console_names_the_set_and_what_is_done(lab):
    study = read_study(lab / "studies" / "in_order" / "study.yaml").study
    plan = compile_plan(study, ParticipantRow("P001"))
    record = read(ledger_path(lab, "in_order", "P001"))
    first = next(event.seq for event in record.events if event.value.get("do") == "ask")
    state = type(record.state)()
    for event in record.events[: first + 1]:
        state.apply(event)
    status = status_of(plan, state)
    assert doing(status.doing) == "putting 2 stimuli in order"
    assert where(status) == (
        "trial 1 of 3 (practice): P1 (P60) and C1 (linen); next C1 (linen) and C2 (wool)"
    )  # fmt: skip
