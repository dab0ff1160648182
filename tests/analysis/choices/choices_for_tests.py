"""R's numbers for choices, and small tables."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

FILE = Path(__file__).parents[1] / "data" / "r" / "choices.json"


@cache
def in_r() -> dict[str, Any]:
    return json.loads(FILE.read_text())


def baseball() -> pd.DataFrame:
    """One row per outcome: winner, loser, home, count."""
    games = pd.DataFrame(in_r()["baseball"])
    won = games.rename(columns={"home": "winner", "away": "loser", "home_wins": "count"}).assign(home=games["home"])
    lost = games.rename(columns={"away": "winner", "home": "loser", "away_wins": "count"}).assign(home=games["home"])
    return pd.concat([won, lost], ignore_index=True)[["winner", "loser", "home", "count"]]


def with_ties() -> pd.DataFrame:
    result = pd.DataFrame(in_r()["ties"])
    rows = []
    for pair in result.itertuples():
        rows.append((pair.first, pair.second, False, pair.first, pair.first_wins))
        rows.append((pair.second, pair.first, False, pair.first, pair.second_wins))
        rows.append((pair.second, pair.first, True, pair.first, pair.ties))
    return pd.DataFrame(rows, columns=["winner", "loser", "tie", "first", "count"])


def choices(text: str) -> pd.DataFrame:
    """ "ab bc" as a over b and b over c."""
    return pd.DataFrame([tuple(pair) for pair in text.split()], columns=["winner", "loser"])
