"""The study of pairs of the how-to through its commands: check, run, replay, collect, and a scale of the stimuli."""

import csv
from pathlib import Path

from palpate.command_line import _status

PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "compare-stimuli-in-pairs.md"
STUDY, PLAN = (block.split("```")[0] for block in PAGE.read_text("utf-8").split("```yaml\n")[1:])


def test_the_how_to_leads_from_the_declaration_to_the_scale(tmp_path, capsys):
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
