"""A door study of made-up numbers: two groups of cars, fifteen variants in six families, seven attributes."""

from __future__ import annotations

import random
from dataclasses import replace

import pandas as pd

from palpate.analysis.ratings.dataset import Crossing, Exclusion, Input, Ratings, Scale

PAIRS = {
    "Easy-to-pull": ("Hard-to-pull", "physical"),
    "Damped": ("Recoiling", "physical"),
    "Consistent": ("Stepwise", "physical"),
    "Pleasant": ("Unpleasant", "emotional"),
    "New": ("Old", "emotional"),
    "Comfort": ("Discomfort", "emotional"),
    "Luxurious": ("Cheap", "emotional"),
}
CARS = {"1": ("BC3", "FORD", "G90"), "2": ("K3", "K8", "MQ4")}
FAMILY = {f"g{i}": "original" if i == 0 else
          ("amplitude", "position", "perturbation", "plateau", "bump")[(i - 1) // 3] for i in range(15)}  # fmt: skip


def door_ratings(people: int = 4, attributes: int = 7, seed: int = 1, variants: int = 15) -> Ratings:
    """`people` in each group; every participant, car, variant and attribute has its rating, a whole number."""
    chosen = list(PAIRS)[:attributes]
    levels = list(FAMILY)[:variants]
    draw = random.Random(seed)
    shift = {(a, v): draw.uniform(-4, 4) for a in chosen for v in levels}
    rows = []
    for group, cars in CARS.items():
        for number in range(people):
            participant = f"P{int(group) * 100 + number:03d}"
            bias = draw.gauss(0, 1)
            for attribute in chosen:
                for car in cars:
                    for variant in levels:
                        value = round(max(-10, min(10, shift[attribute, variant] + bias + draw.gauss(0, 2))))
                        rows.append((participant, group, attribute, float(value), car, variant, FAMILY[variant]))
    names = ["participant", "group", "attribute", "value", "car", "variant", "augmentation"]
    return Ratings(
        name="door_ratings",
        table=pd.DataFrame(rows, columns=names),
        within=("car", "variant"),
        between=("group",),
        attributes=tuple(chosen),
        scale=Scale(-10, 10, 1),
        inputs=(Input("study door_ratings", "a" * 64, "the compiled study"), Input("P100.sqlite", "b" * 64)),
        exclusions=(Exclusion("session", "P199, session s9", "interrupted after 3 of 45 trials", 21),),
        antonyms={a: PAIRS[a][0] for a in chosen},
        categories={a: PAIRS[a][1] for a in chosen},
        crossings=tuple(
            Crossing({"group": group}, {"car": cars, "variant": tuple(levels)}) for group, cars in CARS.items()
        ),
        pooled="variant",
        families="augmentation",
        simulated=True,
    )


def renamed(ratings: Ratings, old: str, new: str) -> Ratings:
    """The same ratings with one name replaced wherever it stands."""
    table = ratings.table.replace(old, new)
    attributes = tuple(new if name == old else name for name in ratings.attributes)
    return replace(
        ratings,
        table=table,
        attributes=attributes,
        antonyms={(new if k == old else k): (new if v == old else v) for k, v in ratings.antonyms.items()},
        categories={(new if k == old else k): v for k, v in ratings.categories.items()},
        crossings=tuple(
            Crossing(c.between, {f: tuple(new if x == old else x for x in levels) for f, levels in c.levels.items()})
            for c in ratings.crossings
        ),
    )


def reasoning(people: int = 6, seed: int = 3) -> Ratings:
    """An imported shape: one attribute on 0..100, inference x plausibility within, instruction between."""
    draw = random.Random(seed)
    rows = [
        (f"{i}", "ab"[i % 2], "rating", float(round(draw.uniform(20, 100))), inference, plausibility)
        for i in range(people)
        for inference in ("MP", "MT", "AC", "DA")
        for plausibility in ("plausible", "implausible")
    ]
    names = ["participant", "instruction", "attribute", "value", "inference", "plausibility"]
    return Ratings(
        name="reasoning",
        table=pd.DataFrame(rows, columns=names),
        within=("inference", "plausibility"),
        between=("instruction",),
        attributes=("rating",),
        scale=Scale(0, 100),
        inputs=(Input("data.csv", "c" * 64),),
    )
