"""How small the error of a made waveform can be at all, whatever the method: floors that no rating can undercut."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.modeling.doors.domain import DoorDomain
from palpate.signals.arrays import Array

Row = dict[str, Any]


def floors(domain: DoorDomain) -> list[Row]:
    """For each split the waveform's mean absolute error in percent, mean over profiles and its SD, of

    - the oracle: of the training side's profiles the one that is nearest to the very waveform that is looked for;
    - the code: the held-out waveform itself, put through as many principal components of the training side's profiles
      as there are attributes, and back: what as many numbers can say of it when they are chosen for that alone.
    """
    return [row for split in domain.splits for row in _of_split(domain, split)]


def _of_split(domain: DoorDomain, split: str) -> list[Row]:
    forces = domain.scaling.force_up(domain.data_of(split).force_N)
    size = len(domain.data.attributes)
    errors: dict[str, list[Array]] = {"oracle": [], "code": []}
    for fold in domain.splits[split]:
        known, tested = forces[fold.train], forces[fold.test]
        errors["oracle"].append(np.array([np.abs(known - profile).mean(axis=1).min() for profile in tested]))
        errors["code"].append(np.abs(_through(known, tested, size) - tested).mean(axis=1))
    meanings = {"oracle": "nearest known profile, found by the waveform itself",
            "code": f"the waveform through {size} principal components"}  # fmt: skip
    return [
        {"split": split, "floor": name, "what": meanings[name], "mae": float(every.mean()),
         "mae_sd": float(every.std(ddof=1)) if len(every) > 1 else None, "n": len(every)}
        for name, every in ((name, np.concatenate(of_fold)) for name, of_fold in errors.items())
    ]  # fmt: skip


def _through(known: Array, tested: Array, size: int) -> Array:
    """Return the tested rows as the first components of the known ones give them back."""
    mean = known.mean(axis=0)
    _, _, axes = np.linalg.svd(known - mean, full_matrices=False)
    leading = axes[:size]
    back: Array = mean + (tested - mean) @ leading.T @ leading
    return back
