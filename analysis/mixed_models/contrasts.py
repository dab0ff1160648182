"""The contrasts of type III that lmerTest tests, as rows in internal coordinates.

F does not depend on how a hypothesis is written as rows, but its pooled denominator df does, a little, where the rows
have different df. So the rows are lmerTest's (3.1): with several effects each level against the first, averaged over
the other factors; with one effect alone the rows of a Doolittle factorisation of X'X in treatment coding.
"""

from __future__ import annotations

import numpy as np

from palpate.analysis.mixed_models.design import Design, Effect
from palpate.analysis.mixed_models.linear import kronecker, triangle_of
from palpate.analysis.mixed_models.variables import Variable
from palpate.analysis.statistics.doubles import Floats


def type_three(design: Design, triangle: Floats) -> dict[Effect, Floats]:
    """Each effect's rows; `design` reports sum coding, `triangle` is that of its columns (X'X = its square)."""
    effects = [effect for effect in design.effects if effect]
    if len(effects) == 1:
        return {effects[0]: _doolittle(design, triangle)}
    back, places = design.back(), design.places
    return {effect: _against_first(design, effect) @ back[places[effect]] for effect in effects}


def _against_first(design: Design, effect: Effect) -> Floats:
    return kronecker(_differences(design.variables[name]) for name in effect)


def _differences(variable: Variable) -> Floats:
    """The differences from the first level as combinations of sum-coded coefficients; a number is itself."""
    if variable.table is None:
        return np.ones((1, 1))
    differences: Floats = variable.table[1:] - variable.table[:1]
    return differences


def _doolittle(design: Design, triangle: Floats) -> Floats:
    """The effect's rows of L', where X'X = L D L' in treatment coding; a triangle of X is D^(1/2) L'."""
    back = design.back().copy()
    effect = design.effects[-1]
    if design.variables[effect[0]].table is not None:
        back[1:] = _against_first(design, effect) @ back[1:]
        back[0, 1:] = np.asarray(design.variables[effect[0]].table)[0]
    upper = triangle_of(triangle @ np.linalg.inv(back))
    rows: Floats = (upper / np.diag(upper)[:, None])[1:] @ back
    return rows
