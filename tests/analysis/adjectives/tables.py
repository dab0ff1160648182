"""What the tests of adjective selection share: small studies in which words are ticked."""

from __future__ import annotations

import numpy as np
import pandas as pd

from palpate.analysis.adjectives.selections import Selections, gather_selections

WORDS = ("Rough", "Smooth", "Hard", "Soft", "Vague")


def study(ticks: dict[tuple[str, str], str], offered: tuple[str, ...] = WORDS) -> Selections:
    """Selections from {(participant, stimulus): "Rough Hard"}; one trial for each key."""
    return gather_selections(*tables(ticks), offered)


def tables(ticks: dict[tuple[str, str], str]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The words and the trials of the same."""
    trials = pd.DataFrame(
        [
            {"participant": who, "session": f"s/{who}/1", "trial": n, "stimulus": what}
            for n, (who, what) in enumerate(ticks)
        ]
    )
    words = [
        {**trial, "word": word, "kind": "ticked"}
        for trial, chosen in zip(trials.to_dict("records"), ticks.values(), strict=True)
        for word in chosen.split()
    ]
    return pd.DataFrame(words, columns=[*trials.columns, "word", "kind"]), trials


def random_ticks(people: int, stimuli: int, seed: int = 0) -> dict[tuple[str, str], str]:
    """Words ticked with a chance of their own on each stimulus; Vague is never ticked."""
    rng = np.random.default_rng(seed)
    chance = rng.random((stimuli, len(WORDS) - 1))
    return {
        (f"P{p}", f"T{s}"): " ".join(np.array(WORDS[:-1])[rng.random(len(WORDS) - 1) < chance[s]])
        for p in range(people)
        for s in range(stimuli)
    }
