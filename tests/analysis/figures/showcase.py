"""The pictures of docs/reference/figures.md, made anew from a lab of simulated participants.

    for s in texture_similarity:P001..P012 door_matching:P001..P016 door_authoring:P001..P016 \
             door_adjectives:P001..P020 texture_ratings:P001..P026 texture_preference:P001..P022 \
             roughness_magnitude:P001..P012; do
      palpate run ${s%%:*} --participant ${s##*:} --simulate --seed 1 --lab LAB; done
    palpate collect --lab LAB
    python -m tests.analysis.figures.showcase LAB docs/pictures
"""

from __future__ import annotations

import io
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd
from sqlalchemy import create_engine, text

from palpate.analysis.figures.figure_kind import FigureInput, FigureKind
from palpate.analysis.figures.style import drawing
from palpate.analysis.plans.answers import Selected
from palpate.analysis.plans.kinds import FIGURES, TESTS
from palpate.analysis.ratings.reading import read_ratings
from palpate.analysis.ratings.sources import DataRequest
from palpate.analysis.regenerating.regeneration import by_name, regenerate
from palpate.studies.catalogue import find, read_study
from tests.analysis.figures import test_function_figures

ENDS = ("Strongly disagree", "Strongly agree")


def rated(lab: Path, study: str) -> Selected:
    """The ratings of a study."""
    ratings = read_ratings(create_engine(f"sqlite:///{lab / 'lab.sqlite'}"), study)
    table = ratings.table
    columns = [c for c in table if table[c].dtype == object or str(table[c].dtype) == "str"]
    trials = table.drop(columns=["attribute", "value", "response_time_s", "revised"]).drop_duplicates()
    return Selected(
        table=table,
        trials=trials,
        outcomes=ratings.attributes,
        levels={c: ratings.levels(c) for c in columns},
        scale=None if ratings.scale is None else (ratings.scale.low, ratings.scale.high),
        antonyms=ratings.antonyms,
        categories=ratings.categories,
    )


def query(lab: Path, sql: str) -> pd.DataFrame:
    with create_engine(f"sqlite:///{lab / 'lab.sqlite'}").connect() as connection:
        return pd.read_sql(text(sql), connection)


def nothing() -> Selected:
    empty = pd.DataFrame({"participant": pd.Series(dtype=object)})
    return Selected(table=empty, trials=empty, outcomes=(), levels={})


def treemap(lab: Path) -> FigureInput:
    """The relevance of the words that were ticked at the six doors."""
    study = read_study(find("door_adjectives", lab)).study
    sql = "SELECT session, trial, stimulus FROM trials WHERE session LIKE 'door_adjectives/%' AND practice = 0"
    trials = query(lab, sql).assign(group="")
    trials["participant"] = trials["session"].str.split("/").str[1]
    ticked = query(lab, "SELECT session, trial, word, kind FROM words WHERE session LIKE 'door_adjectives/%'")
    chosen = Selected(
        table=ticked.merge(trials, on=["session", "trial"]),
        trials=trials,
        outcomes=(),
        levels={"stimulus": tuple(stimulus.id for stimulus in study.stimuli)},
        offered=tuple(word.word for word in study.adjectives.words),
    )
    kind = TESTS["relevance"]
    settings = kind.settings(name="relevance", test="relevance", normalisation="share_of_trials", threshold=0.2)
    return FigureInput(chosen, {"relevance": {"": kind.answer(chosen, settings)}})


def similarity(lab: Path) -> FigureInput:
    """The ratings of likeness, and the paired tests between methods over all textures."""
    ratings = replace(rated(lab, "texture_similarity"), outcomes=("Similarity",))
    kind = TESTS["pairs"]
    settings = kind.settings(name="methods", test="pairs", factor="method", correction="bonferroni")
    return FigureInput(ratings, {"methods": {"": kind.answer(ratings, settings)}})


def matching(lab: Path) -> FigureInput:
    return FigureInput(rated(lab, "door_matching"))


def questionnaire(lab: Path) -> FigureInput:
    """The five statements after making doors."""
    sql = "SELECT session, form, item AS attribute, number AS value FROM answers WHERE session LIKE 'door_authoring/%'"
    table = query(lab, sql)
    table["participant"] = table["session"].str.split("/").str[1]
    return FigureInput(replace(nothing(), table=table, levels={"attribute": tuple(dict.fromkeys(table["attribute"]))}))


def space(lab: Path) -> FigureInput:
    """The textures' map from their mean ratings, its ellipses from resampled participants, and the attributes in it."""
    ratings, answers = rated(lab, "texture_ratings"), {}
    for name, more in (("mds", {"starts": 4, "replications": 100, "reference": 0}), ("vectors", {"starts": 4})):
        kind = TESTS[name]
        answers[name] = {"": kind.answer(ratings, kind.settings(name=name, test=name, **more))}
    return FigureInput(ratings, answers)


def predictions(lab: Path) -> FigureInput:
    """Each texture's mean ratings, predicted by the mean of the other textures of its class (of all where alone)."""
    ratings = rated(lab, "texture_ratings")
    by = ratings.table.groupby(["attribute", "stimulus", "class"])["value"]
    means = by.agg(actual="mean", sd="std").reset_index()
    return FigureInput(
        replace(ratings, table=means.assign(predicted=[_others(means, row) for _, row in means.iterrows()]))
    )


def _others(means: pd.DataFrame, row: pd.Series) -> float:
    others = means[(means["attribute"] == row["attribute"]) & (means["stimulus"] != row["stimulus"])]
    alike = others[others["class"] == row["class"]]
    return float((alike if len(alike) else others)["actual"].mean())


def functions(_lab: Path) -> FigureInput:
    """Functions of two observers written for tests, in three procedures."""
    return FigureInput(nothing(), {"f": {"": test_function_figures.functions()}})


def preferences(lab: Path) -> FigureInput:
    """The scale of the shipped plan of preferences among fabrics."""
    return FigureInput(nothing(), by_name(regenerate(DataRequest("texture_preference", lab)).answered))


def magnitudes(lab: Path) -> FigureInput:
    """The power law of the shipped plan of magnitude estimates."""
    return FigureInput(nothing(), by_name(regenerate(DataRequest("roughness_magnitude", lab)).answered))


FUNCTIONS = (functions, {"tests": ("f",)})
SHOWN = {
    "psychometric": FUNCTIONS,
    "track": (functions, {"tests": ("f",), "columns": 2}),
    "posterior": FUNCTIONS,
    "power_law": (magnitudes, {"tests": ("exponent",)}),
    "estimates": (preferences, {"tests": ("scale",)}),
    "predicted": (predictions, {"panels": "attribute", "unit": "0 to 100"}),
    "predicted-class": (predictions, {"figure": "predicted", "panels": "class", "colour": "attribute"}),
    "similarity_bars": (similarity, {"tests": ("methods",)}),
    "matching": (matching, {}),
    "likert": (questionnaire, {"points": (1, 7), "ends": ENDS}),
    "likert-bars": (questionnaire, {"figure": "likert", "style": "bars", "points": (1, 7), "ends": ENDS}),
    "map": (space, {"tests": ("mds", "vectors"), "class_column": "class"}),
    "class_heatmap": (predictions, {"unit": "0 to 100"}),
    "violins": (predictions, {"unit": "0 to 100"}),
    "treemap": (treemap, {"tests": ("relevance",), "threshold": 0.2}),
}


def save(kind: FigureKind, inputs: FigureInput, settings: dict, to: Path) -> str:
    """Draw one figure; gives its caption."""
    from PIL import Image

    with drawing(to.stem):
        data = kind.data(inputs, kind.settings(name="shown", **settings))
        drawn, buffer = kind.draw(data), io.BytesIO()
        drawn.figure.savefig(buffer, format="png", dpi=110, metadata={"Software": None})
    Image.open(buffer).convert("RGB").save(to, optimize=True)
    return f"{len(data.rows)} rows, {len(drawn.marks)} marks, {to.stat().st_size // 1000} kB\n{data.caption}"


def main() -> None:
    lab, to = Path(sys.argv[1]), Path(sys.argv[2])
    for name in sys.argv[3:] or SHOWN:
        make, settings = SHOWN[name]
        kind = settings.get("figure", name)
        print(name, save(FIGURES[kind], make(lab), {"figure": kind, **settings}, to / f"figure-{name}.png"))


if __name__ == "__main__":
    main()
