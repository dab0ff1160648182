"""No command gives NaN or infinity for a result: not in a table, not in JSON, not in a report."""

import csv
import json
import re
from math import inf, nan

import pytest

from palpate.analysis.exporting.tabular import Column, Table, write_csv
from palpate.analysis.reports.csv_files import NotFinite, csv_text
from palpate.protocols.canonical import NotCanonical, json_text
from tests.commands_for_tests import run_command

MAP = """
name: hard
source: made for a test
files: table.csv
columns: {participant: who, stimulus: what, value: y, attribute_is: Roughness, within: {tool: tool, surface: surface}}
"""
HARD = {
    "all equal": lambda person, cell: 50.0,
    "cells differ, people do not": lambda person, cell: 10.0 * cell,
    "people differ, cells do not": lambda person, cell: 10.0 * person,
    "too close together": lambda person, cell: 1.0 + 1e-16 * cell * person,
    "tiny": lambda person, cell: 1e-300 * (cell + person * (cell % 2)),
    "huge": lambda person, cell: 1e99 * (cell + person * (cell % 2)),
    "one stands out": lambda person, cell: 1e8 if person == cell == 1 else 0.0,
}
PLAN = """
study: hard
tests:
  - {name: means, test: means, by: [tool]}
  - {name: variance, test: anova, within: [tool, surface]}
  - {name: pairs, test: pairs, factor: surface}
  - {name: alike, test: equivalence, factor: surface, bounds_dz: 0.5}
  - {name: mixed, test: mixed_model, fixed: [tool]}
  - {name: ranks, test: friedman, factor: surface}
  - {name: signs, test: wilcoxon, factor: surface}
  - {name: aligned, test: aligned_ranks, within: [tool, surface]}
  - {name: agree, test: icc}
  - {name: agree_in_order, test: kendall_w}
  - {name: alpha, test: krippendorff_alpha, level: interval}
  - {name: map, test: pca}
"""


def hard_lab(folder, value, people):
    lines = ["who,what,tool,surface,y"] + [
        f"P{person},{cell},t{cell % 2},s{cell // 2},{value(person, cell)!r}"
        for person in range(people)
        for cell in range(4)
    ]
    (folder / "table.csv").write_text("\n".join(lines) + "\n")
    (folder / "hard.yaml").write_text(MAP)
    (folder / "studies" / "hard").mkdir(parents=True)
    (folder / "studies" / "hard" / "analysis.yaml").write_text(PLAN)


def not_finite(path):
    """What reads as NaN or as infinity in a file that a command wrote."""
    text = path.read_text("utf-8")
    if path.suffix == ".csv":
        return [cell for row in csv.reader(text.splitlines()) for cell in row if re.fullmatch(r"[-+]?(nan|inf)", cell)]
    if path.suffix == ".json":
        constants = []
        json.loads(text, parse_constant=constants.append)
        return constants
    return re.findall(r"(?<![\w.#-])[-+]?(?:nan|inf)(?![\w-])", re.sub(r"<style.*?</style>", "", text, flags=re.DOTALL))


@pytest.mark.parametrize(
    "people", [pytest.param(1, marks=pytest.mark.long), 2, pytest.param(5, marks=pytest.mark.long)]
)
@pytest.mark.parametrize("kind", HARD)
def test_hard_ratings_give_finite_numbers_or_a_refusal(tmp_path, kind, people):
    hard_lab(tmp_path, HARD[kind], people)
    code, _, error = run_command("import", tmp_path / "hard.yaml", "--lab", tmp_path)
    assert code == 0, error
    for words in (
        ("analyse", "hard", "--no-figures", "--json"), ("report", "hard", "--to", tmp_path / "report.html"),
        ("regenerate", "hard", "--no-figures", "--no-crosscheck", "--json"),
    ):  # fmt: skip
        code, out, error = run_command(*words, "--lab", tmp_path)
        assert code == 0, error
        assert not re.search(r"\b(NaN|Infinity|nan|inf)\b", out + error)
    written = [path for path in tmp_path.rglob("*") if path.suffix in {".csv", ".json", ".html"}]
    assert {path.name: constants for path in written if (constants := not_finite(path))} == {}


def test_the_writers_refuse_what_is_not_finite_and_say_where(tmp_path):
    with pytest.raises(NotFinite, match="column F: a number is infinite"):
        csv_text([{"F": 1.0}, {"F": inf}])
    with pytest.raises(NotFinite, match="column p: a number is infinite"):
        write_csv(tmp_path / "a.csv", Table("a", "", (Column("p", "a probability", "number"),), list), [{"p": -inf}])
    assert not (tmp_path / "a.csv").exists()
    assert csv_text([{"p": nan, "q": 1.0}]) == "p,q\n,1.0\n"
    with pytest.raises(NotCanonical, match=r"^\$\.rows\[1\]\.p: nan is not a finite number$"):
        json_text({"rows": [{"p": 0.5}, {"p": nan}]})
