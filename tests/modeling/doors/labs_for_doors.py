"""A lab with the recorded sessions of a small door study, in a temporary folder."""

from __future__ import annotations

import shutil
from pathlib import Path

RECORDED = Path(__file__).parents[2] / "recorded"


def doors_small(folder, people=range(1, 13)):
    """A lab with the recorded sessions of doors_small and the study itself."""
    lab = folder / "lab"
    shutil.copytree(RECORDED / "doors_small", lab / "studies" / "doors_small")
    (lab / "sessions").mkdir()
    for number in people:
        name = f"doors_small_P{number:03d}_s1.sqlite"
        shutil.copyfile(RECORDED / "sessions" / name, lab / "sessions" / name)
    return lab
