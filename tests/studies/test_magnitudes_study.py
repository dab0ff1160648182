"""The study of the how-to on magnitude estimation through its commands, to the exponent that simulated people have."""

import csv
from pathlib import Path

import pytest

from palpate.command_line import _status

PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "estimate-magnitudes.md"
STUDY, PLAN = (block.split("```")[0] for block in PAGE.read_text("utf-8").split("```yaml\n")[1:])


def test_the_how_to_leads_from_the_declaration_to_the_exponent(tmp_path, capsys):
    lab = str(tmp_path / "lab")
    assert _status(["init", lab]) == 0
    folder = tmp_path / "lab" / "studies" / "gratings"
    folder.mkdir()
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    (folder / "analysis.yaml").write_text(PLAN, encoding="utf-8")
    for command in (
        "check gratings", "run gratings --participant P001..P008 --simulate", "replay", "collect",
        "regenerate gratings --check-plan", "regenerate gratings --no-crosscheck",
    ):  # fmt: skip
        assert _status([*command.split(), "--lab", lab]) == 0, command
    tests = tmp_path / "lab" / "regenerated" / "gratings" / "tests"
    with (tests / "exponent.csv").open() as file:
        [row] = csv.DictReader(file)
    # a weight of 0.25 decades for an SD of 0.2458 (0, 0.301, 0.602): an exponent of 1.017, times gains of mean 1
    assert float(row["exponent"]) == pytest.approx(0.25 / 0.24577, abs=0.25) and int(row["people"]) == 8
    with (tests / "exponent.stimuli.csv").open() as file:
        magnitudes = [float(row["magnitude"]) for row in csv.DictReader(file)]
    assert magnitudes == sorted(magnitudes) and len(magnitudes) == 3
    capsys.readouterr()
    (folder / "analysis.yaml").write_text(PLAN.replace("period_mm", "period"), encoding="utf-8")
    assert _status(["regenerate", "gratings", "--check-plan", "--lab", lab]) != 0
    assert "tests[0].intensity: the table 'fields' has no column 'period'" in capsys.readouterr().err
