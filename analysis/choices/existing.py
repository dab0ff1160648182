"""Whether a scale of the items exists: it does not where one group of items never lost to the rest."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from palpate.analysis.choices.counted import Counted
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import StatisticsError, listed


class NoEstimate(StatisticsError):
    """Data from which the asked numbers cannot be told: the likelihood has no maximum at finite values."""


def refuse_unconnected(counted: Counted) -> None:
    """Refuse comparisons in which some item cannot be reached from every other through wins or ties.

    Ford 1957: exactly then the maximum of the likelihood is not at finite worths. Raises NoEstimate naming the items.
    """
    beats = (counted.wins() + counted.tied()) > 0
    weak, group = connected_components(csr_array(beats), connection="weak")
    if weak > 1:
        parts = " and ".join(_names(counted.items, group == i) for i in range(min(weak, 3)))
        raise NoEstimate(
            f"the comparisons fall into {weak} parts that were never compared with each other ({parts}); "
            "scale each part by itself, or compare items across them"
        )
    strong, group = connected_components(csr_array(beats), connection="strong")
    if strong > 1:
        raise NoEstimate(_one_sided(counted.items, beats, group, strong))


def _one_sided(items: tuple[Hashable, ...], beats: Any, group: Any, strong: int) -> str:
    for i in sorted(range(strong), key=lambda i: (int((group == i).sum()), int(np.argmax(group == i)))):
        inside = group == i
        for won, lost, what in ((inside, ~inside, "lost to"), (~inside, inside, "beat")):
            if beats[np.ix_(won, lost)].any() and not beats[np.ix_(lost, won)].any():
                return (
                    f"{_names(items, inside)} never {what} any of the other items, so how far apart they are has no "
                    "estimate; leave them out, or add comparisons that could go the other way"
                )
    return "the items cannot be brought into one scale: no chain of wins leads back"


def _names(items: tuple[Hashable, ...], chosen: Any) -> str:
    found = [repr(items[i]) for i in np.flatnonzero(chosen).tolist()]
    return listed(found, len(found)).replace("; ", ", ")


def refuse_separated(better: Floats, names: list[str]) -> None:
    """Refuse a model that some change of its parameters fits ever better: rows of `better` are what each answer adds.

    Albert & Anderson 1984, by a linear programme: a direction along which no answer becomes less likely, some more.
    """
    if not len(better):
        return
    found = linprog(-better.sum(axis=0), A_ub=-better, b_ub=np.zeros(len(better)), bounds=(-1, 1), method="highs")
    if found.status == 0 and -found.fun > 1e-7:
        moving = [name for name, value in zip(names, found.x, strict=True) if abs(value) > 1e-9]
        raise NoEstimate(
            f"the answers fit ever better as {listed(moving, len(moving))} grow without end; "
            "leave such an effect out, or gather answers that contradict it"
        )
