"""Tracks, observers and sessions of procedures."""

import math
import random

from palpate.protocols.plan import compile_plan
from palpate.protocols.procedures import procedures_from
from palpate.protocols.study import Stimulus, Study
from palpate.protocols.tracks import Track
from palpate.protocols.trial import ParticipantRow
from palpate.studies.procedures.adviser import End

GRID = {"column": "level_db", "from": -40, "to": 0, "points": 41}
MODEL = {
    "shape": "weibull",
    "scale": "db",
    "threshold": {"from": -40, "to": 0, "points": 41},
    "slope": {"from": 0.5, "to": 10, "points": 20},
    "guess": 0.5,
    "lapse": [0, 0.02, 0.04],
}
QUESTPLUS = {"kind": "questplus", "level": GRID, "model": MODEL, "stop": {"trials": 128}}
TWO_DOWN = {
    "kind": "staircase", "level": {"column": "level_db", "from": -40, "to": 20, "points": 241}, "start": 0, "down": 2,
    "step": [16, 8, 4, 2, 1], "stop": {"trials": 200, "reversals": 8}, "last": 6,
}  # fmt: skip


def track(settings, **changes):
    [procedure] = procedures_from({**settings, **changes})
    return Track("t", procedure, procedure.grids[0].levels, (Stimulus(id="t"),), ("k", 1))


def share(level, threshold=-18.0, slope=3.0, guess=0.5, lapse=0.02):
    """The share of hits of an observer with a Weibull function in dB (Watson 2017, equation 2)."""
    return guess + (1 - guess - lapse) * (1 - math.exp(-(10 ** min(300.0, slope * (level - threshold) / 20))))


def ran(adviser, of, most=10_000, answers=None, seed=0, **observer):
    """Return the past of a track that is run to its end; `answers` are given, else those of an observer."""
    chance, past = random.Random(seed), ()
    while len(past) < most and not isinstance(step := adviser.advise(past), End):
        level = of.levels[step.index]
        hit = answers(level) if answers is not None else chance.random() < share(level, **observer)
        past = (*past, (step.index, hit))
    return past


def study(procedure=QUESTPLUS, **changes):
    """Two tracks of a two-interval task."""
    data = {
        "study": "toy", "task": "intervals",
        "stimuli": [{"id": f"f{hz}", "columns": {"frequency_hz": str(hz)}} for hz in (40, 250)],
        "intervals": {"seconds": 0.5},
        "procedure": procedure,
        "order": {"design": "random"},
        "simulation": {"observer": {"threshold": {"f40": -10, "f250": -25}, "scale": "db"}},
    }  # fmt: skip
    return Study.model_validate({**data, **changes})


def plan(procedure=QUESTPLUS, seed=0, **changes):
    return compile_plan(study(procedure, **changes), ParticipantRow("P001"), seed)
