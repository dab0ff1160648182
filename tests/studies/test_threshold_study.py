"""A threshold study through every command: check, run, kill, resume, replay, collect, export, regenerate."""

import csv
import sqlite3
from contextlib import closing

import pytest

from palpate.command_line import _status
from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import read_study
from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.record import read
from palpate.studies.sessions.session_files import ledger_path

STUDY = """study: pressure
task: intervals
stimuli:
  - {id: index, finger: index}
  - {id: little, finger: little}
intervals: {design: yes_no, catch: {absent: {every: 2}, exclude_above: 0.5}}
ask:
  - {name: felt, kind: choice, of: intervals}
  - {name: sure, kind: confidence}
  - {name: like, kind: scale, from: 0, to: 10, step: 1}
  - {name: remark, kind: text, optional: true}
procedure:
  kind: questplus
  level: {column: force_mN, values: [1, 2, 4, 8, 16, 32, 64]}
  model: {threshold: {from: 1, to: 64, points: 13, spacing: log}, slope: [2, 4], guess: [0, 0.1], lapse: 0.02}
  stop: {trials: 40}
practice: {stimuli: [index], until: {correct: 2, of: 2}, at_most: 4}
feedback: {after: practice}
order: {design: random, within: block, blocks: {by: finger, instructions: {little: Now the little finger.}}}
simulation: {observer: {threshold: {index: 6, little: 20}, guess: 0.05, slope: 3}}
"""
PLAN = """study: pressure
tests:
  - {name: thresholds, test: psychometric, source: choices, function: weibull}
"""
AT = {"at": "2026-01-01T00:00:00+00:00"}


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    lab = tmp_path_factory.mktemp("lab")
    assert _status(["init", str(lab)]) == 0
    folder = lab / "studies" / "pressure"
    folder.mkdir(parents=True)
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    (folder / "analysis.yaml").write_text(PLAN, encoding="utf-8")
    for command in (["run", "pressure", "--participant", "P001..P002", "--simulate"], ["collect"]):
        assert _status([*command, "--lab", str(lab)]) == 0
    return lab


def rows(lab, query):
    with closing(sqlite3.connect(lab / "lab.sqlite")) as database:
        return database.execute(query).fetchall()


def test_choices_and_further_answers_are_collected_with_the_number_of_the_session(lab):
    [(count, sessions)] = rows(lab, "SELECT count(*), count(DISTINCT session) FROM choices WHERE session_number = 1")
    assert sessions == 2 and count >= 2 * (2 * 60 + 2)
    kinds = rows(
        lab, "SELECT catch, target, count(DISTINCT track) FROM choices WHERE NOT practice GROUP BY catch, target"
    )
    assert kinds == [("absent", "noise", 2), ("none", "signal", 2)]
    assert rows(lab, "SELECT DISTINCT question, kind FROM fields") == [("like", "scale")]
    assert rows(lab, "SELECT count(*) FROM choices WHERE confidence BETWEEN 1 AND 4 AND rt_s > 0") == [(count,)]
    levels = {level for (level,) in rows(lab, "SELECT DISTINCT level FROM choices WHERE level IS NOT NULL")}
    assert levels <= {1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0} and len(levels) > 3


def test_a_session_killed_here_and_there_goes_on_to_the_uninterrupted_one(lab, tmp_path):
    """After each event: tests/studies/procedures/test_advised.py, without files."""
    study = read_study(lab / "studies" / "pressure" / "study.yaml").study
    whole = read(ledger_path(lab, "pressure", "P001", 1))
    assert compile_plan(study, ParticipantRow("P001", None, whole.header["row"])).digest == whole.header["plan"]
    for cut in (len(whole.events) // 3, 2 * len(whole.events) // 3):
        other = tmp_path / f"lab{cut}"
        assert _status(["init", str(other)]) == 0
        folder = other / "studies" / "pressure"
        folder.mkdir(parents=True)
        (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
        path = ledger_path(other, "pressure", "P001", 1)
        path.parent.mkdir(exist_ok=True)
        create(path, whole.header, AT)
        ledger = open_for_append(path, AT)
        for event in whole.events[1:cut]:
            ledger.append(event)
        ledger.close(AT)
        assert _status(["resume", str(path)]) == 0
        assert [(e.kind, e.trial, e.attempt, e.body) for e in read(path).events] == [
            (e.kind, e.trial, e.attempt, e.body) for e in whole.events
        ]


def test_sessions_replay_and_their_choices_are_made_again(lab, run_palpate):
    output = run_palpate("replay", "--recompute", "--lab", str(lab))
    assert "2 of 2 sessions repeat exactly" in output and "all as recorded" in output


def test_choices_are_exported_and_free_text_only_on_request(lab, tmp_path, run_palpate):
    run_palpate("export", "pressure", "--lab", str(lab), "--to", str(tmp_path / "shared"), "--csv")
    with (tmp_path / "shared" / "choices.csv").open(encoding="utf-8") as file:
        choices = list(csv.DictReader(file))
    assert len(choices) == rows(lab, "SELECT count(*) FROM choices")[0][0]
    assert {"track", "level", "target", "chosen", "correct", "confidence", "rt_s"} <= set(choices[0])
    with (tmp_path / "shared" / "fields.csv").open(encoding="utf-8") as file:
        assert {row["question"] for row in csv.DictReader(file)} == {"like"}


def test_the_report_has_a_threshold_for_each_finger(lab, run_palpate):
    run_palpate("regenerate", "pressure", "--lab", str(lab))
    report = (lab / "regenerated" / "pressure" / "report.html").read_text(encoding="utf-8")
    assert "track index: threshold" in report and "track little: threshold" in report
