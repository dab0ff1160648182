"""Figures of the key-switch curves: each method's error on held-out switches beside the time of its training."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from benchmarks.keyswitch.comparing import KIND, RECONSTRUCTION, MethodScore, Part, outcome, row_of, ways
from benchmarks.keyswitch.curves import Curves, measured
from benchmarks.keyswitch.outcome import Outcome
from benchmarks.keyswitch.settings import QUICK, REDUCED, Size
from palpate.protocols.bench import Case

AREA = "key switches"
TITLES = {RECONSTRUCTION: "a curve from a code", KIND: "linear, tactile or clicky"}
ERRORS = {
    RECONSTRUCTION: "gf, mean absolute; held-out families",
    KIND: "% wrong, mean over kinds; held-out families",
}


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of training and answers of every method on every fold; `quick` trains networks for two epochs."""
    size, curves = (QUICK if quick else REDUCED), measured()
    for way in ways(size):
        yield _case(way, size, curves)


def _case(way: tuple[str, str, int | None], size: Size, curves: Curves) -> Case:
    task, method, code = way
    trained = f", {size.epochs} epochs" if method == "network" else ""
    method_name = f"palpate, {method}" if method == "network" else method
    name = f"{method_name}{f', {code} numbers' if code else ''}{trained}"
    input_name = f"{len(curves)} curves, {size.folds} folds"
    return Case(
        AREA, TITLES[task], name, input_name, len(curves), ERRORS[task],
        partial(_all_folds, way, size, curves), partial(_error, way, size, curves), 1 if method == "network" else 3,
    )  # fmt: skip


def _all_folds(way: tuple[str, str, int | None], size: Size, curves: Curves) -> list[Outcome]:
    return [outcome(Part(*way, fold, size, curves)) for fold in range(size.folds)]


def _error(way: tuple[str, str, int | None], size: Size, curves: Curves, outcomes: list[Outcome]) -> float:
    row: MethodScore = row_of(way, curves, size, outcomes)
    return row.error
