"""A table of ratings, and recordings as tables beside it."""

import numpy as np

from tests.modeling.textures.textures_for_tests import hand, vibration

HEADER = "id,label,category,Rough-Smooth,Flat-Bumpy,Sticky-Slippery,Hard-Soft"


def rated(place, *ids):
    lines = [f"{name},{name} it is,wood,20,{30 + number},60,5" for number, name in enumerate(ids)]
    place.mkdir(exist_ok=True)
    (place / "ratings.csv").write_text("\n".join([HEADER, *lines]) + "\n", encoding="utf-8")
    return place


def table(place, name, seconds=4.0, rate=2000, seed=0):
    n = round(seconds * rate)
    speed, force = hand(n, rate, seed)
    place.mkdir(exist_ok=True)
    np.savetxt(
        place / f"{name}.csv", np.column_stack([np.arange(n) / rate, vibration(n, seed), speed, force]), fmt="%.6f",
        delimiter=",", header="time,acceleration,speed,force", comments="",
    )  # fmt: skip
