"""Comparison of Palpate's numbers with those of another program, with relative errors."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.analysis.first_look.study_statistics import Row, Test
from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.did_you_mean import nearest

if TYPE_CHECKING:
    from rich.table import Table

SHIPPED = Path(__file__).resolve().parent.parent / "reference" / "r_reference.json"
SHIPPED_KEYS = {"sk2011": "sk2011_2way"}
TOLERANCE = 1e-9
"""The largest relative error that counts as agreement; R itself is within 2e-13 of the exact values."""

COLUMNS = {
    "SS": "SS",
    "SS_error": "SS_error",
    "F": "F",
    "p": "p_unc",
    "GG_eps": "eps",
    "p_GG": "p_GG_corr",
    "HF_eps_raw": "eps_HF",
    "p_HF": "p_HF_corr",
    "pes": "np2",
    "ges": "ng2",
}
"""The reference's name of a number (R, package afex) and ours. R does not limit its Huynh-Feldt epsilon to 1."""

SHOWN = {"SS_error": "SS error", "GG_eps": "ε (GG)", "p_GG": "p (GG)", "HF_eps_raw": "ε (HF)", "p_HF": "p (HF)",
         "pes": "partial η²", "ges": "generalized η²"}  # fmt: skip


@dataclass(frozen=True)
class Compared:
    """One number: ours, the reference's, and |ours - reference| / |reference| (None if ours is undefined)."""

    effect: str
    number: str
    ours: float | None
    reference: float
    relative_error: float | None

    @property
    def agrees(self) -> bool:
        """Whether the two agree within `TOLERANCE`."""
        return self.relative_error is not None and self.relative_error <= TOLERANCE


def compare_with_reference(table: Iterable[Row], reference: Mapping[str, Any]) -> list[Compared]:
    """Return every number of an analysis of variance that the reference has, beside the reference's.

    `table` holds rows of `rm_anova` (or of a `Test`), `reference` an entry of r_reference.json: effects by name,
    a:b for an interaction. Raises DataRefused where the reference has an effect that the table lacks.
    """
    rows = {str(row["Source"]): row for row in table}
    compared = []
    for effect, numbers in reference["effects"].items():
        if effect not in rows:
            raise DataRefused(f"the reference has the effect {effect!r}; {nearest(effect, rows)}")
        for name, column in COLUMNS.items():
            if name not in numbers or column not in rows[effect]:
                continue
            theirs = float(numbers[name]) if name != "HF_eps_raw" else min(1.0, float(numbers[name]))
            ours = rows[effect][column]
            error = None
            if ours is not None and not math.isnan(ours):
                error = abs(ours - theirs) / abs(theirs) if theirs else 0.0 if ours == 0 else float("inf")
            compared.append(Compared(effect, name, ours, theirs, error))
    return compared


def read_reference(choice: str, name: str) -> Mapping[str, Any]:
    """Return the reference of a data set: `r` for the shipped values of R, or FILE.json#KEY.

    Raises DataRefused where there is none, OSError where the file cannot be read.
    """
    if choice == "r" and name not in SHIPPED_KEYS:
        known = ", ".join(SHIPPED_KEYS)
        raise DataRefused(f"no values of R are shipped for {name!r}, only for {known}; name a file as FILE.json#KEY")
    path, _, key = (str(SHIPPED), "#", SHIPPED_KEYS[name]) if choice == "r" else choice.partition("#")
    try:
        entries = json.loads(Path(path).read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise DataRefused(f"{path}: no JSON ({error}); a reference is a JSON object of named entries") from None
    if not isinstance(entries, dict) or key not in entries:
        raise DataRefused(f"{path}: no entry {key!r}; {nearest(key, list(entries))}")
    effects = entries[key].get("effects") if isinstance(entries[key], dict) else None
    if not isinstance(effects, dict) or not all(isinstance(numbers, dict) for numbers in effects.values()):
        raise DataRefused(f"{path}#{key}: no analysis of variance; an object `effects` of named numbers is expected")
    return {"effects": effects}


def fitting_test(tests: Iterable[Test], reference: Mapping[str, Any]) -> Test:
    """Return the test that has every effect of the reference. Raises DataRefused if none or several have."""
    effects = set(reference["effects"])
    fitting = [test for test in tests if effects <= {row.get("Source") for row in test.rows}]
    if len(fitting) != 1:
        named = ", ".join(sorted(effects))
        raise DataRefused(f"{len(fitting)} tests have the effects {named}; a reference belongs to exactly one")
    return fitting[0]


def comparison_table(compared: Iterable[Compared], title: str) -> Table:
    """Return the comparison for a terminal."""
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("number", no_wrap=True)
    for heading in ("palpate", "reference", "relative error"):
        table.add_column(heading, justify="right", no_wrap=True)
    for effect, numbers in groupby(compared, key=lambda comparison: comparison.effect):
        table.add_row(f"[bold]{escape(effect.replace(':', ' × '))}[/bold]")
        for comparison in numbers:
            name = SHOWN.get(comparison.number, comparison.number)
            error = comparison.relative_error
            text = "undefined" if error is None else "0" if error == 0 else f"{error:.1e}"
            shown = text if error is not None and comparison.agrees else f"[red]{text}[/red]"
            table.add_row(f"  {name}", _text(comparison.ours), _text(comparison.reference), shown)
        table.add_section()
    return table


def _text(value: float | None) -> str:
    return "undefined" if value is None else f"{value:.10g}"
