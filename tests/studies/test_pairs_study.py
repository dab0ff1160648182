"""A study of pairs through the commands: check, run, replay, collect, and a scale of what was preferred."""

import csv

from palpate.command_line import _status

STUDY = """study: papers
task: intervals
stimuli: [{id: P150, um: 150}, {id: P80, um: 80}, {id: P120, um: 120}]
intervals: {seconds: 1.0, at_once: false}
pairs: {orders: one}
ask:
  - {name: rougher, kind: choice, of: intervals, text: "Which one was rougher?"}
  - {name: sure, kind: confidence}
order: {design: random, repeats: 4}
practice: {stimuli: [P80, P150]}
simulation: {latents: {rougher: {um: 1}}, noise_sd: 0.8}
"""
PLAN = """study: papers
tests:
  - {name: scale, test: bradley_terry, source: choices, first: stimulus}
"""


def test_from_the_declaration_to_the_scale(tmp_path, capsys):
    lab = str(tmp_path / "lab")
    assert _status(["init", lab]) == 0
    folder = tmp_path / "lab" / "studies" / "papers"
    folder.mkdir()
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    (folder / "analysis.yaml").write_text(PLAN, encoding="utf-8")
    for command in (
        "check papers", "run papers --participant P001..P010 --simulate", "replay", "collect",
        "regenerate papers --no-figures --no-crosscheck",
    ):  # fmt: skip
        assert _status([*command.split(), "--lab", lab]) == 0, command
    with (tmp_path / "lab" / "regenerated" / "papers" / "tests" / "scale.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["item"] for row in sorted(rows, key=lambda row: float(row["value"]))] == ["P80", "P120", "P150"]
    assert {int(row["comparisons"]) for row in rows} == {10 * 4 * 2}
    capsys.readouterr()
    wrong = PLAN.replace("bradley_terry", "psychometric").replace(", first: stimulus", "")
    (folder / "analysis.yaml").write_text(wrong, encoding="utf-8")
    assert _status(["regenerate", "papers", "--check-plan", "--lab", lab]) != 0
    assert "line 3: tests[0].test: pairs of stimuli have no levels" in capsys.readouterr().err
