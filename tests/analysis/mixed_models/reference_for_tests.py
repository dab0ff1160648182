"""R's fits (lme4, lmerTest), the tables they are about, and ours of the same model."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path

import pandas as pd

from palpate.analysis.mixed_models.model import mixed_model

FOLDER = Path(__file__).parent.parent / "data" / "r"


@cache
def whole():
    return json.loads((FOLDER / "lmm_reference.json").read_text(encoding="utf-8"))


NAMES = list(whole()["models"])


def expected(name):
    return whole()["models"][name]


@cache
def table(name):
    return pd.read_csv(FOLDER / expected(name)["csv"])


@cache
def ours(name, **also):
    return mixed_model(table(name), "y", **model_options(name), **also)


def model_options(name):
    given = expected(name)["ours"]
    return {**given, "reml": "REML = TRUE" in expected(name)["call"]}


def plain(effect):
    """Our name of a coefficient as R writes it."""
    return re.sub(r"\[(.*?)\]", r"\1", effect)


def group_of(name):
    """A nested grouping factor or level whichever way round it is written: R says cask:batch for batch/cask."""
    return ":".join(sorted(str(name).split(":")))
