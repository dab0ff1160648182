"""The report of an evaluation of doors: one HTML file."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.analysis.reports.figures import DrawnFigure, chosen, figure_block
from palpate.analysis.reports.page import (
    EVALUATION,
    Block,
    Column,
    Page,
    Points,
    Section,
    TableBlock,
    Words,
    page_html,
    table,
)
from palpate.analysis.reports.tables import NONE, in_seconds, written
from palpate.modeling.doors.evaluation import words
from palpate.modeling.doors.evaluation.evaluate import DoorEvaluation
from palpate.modeling.doors.evaluation.forward_section import forward_section
from palpate.modeling.doors.evaluation.inverse_section import inverse_section
from palpate.modeling.doors.evaluation.tables import Row
from palpate.modeling.doors.evaluation.words import LEAD
from palpate.modeling.doors.measured_door import Recovered
from palpate.modeling.evaluate.outputs import software_table

TITLE = "Car doors: how well feelings are predicted, and profiles made"
TARGETS = {"mae": 3.5, "rmse": 5.0, "r2": 0.85, "loop": 5.0, "waveform": 1.0}
"""What the project set out to reach, on 0..100 and percent."""
MEASURED = (
    Column("attribute", "attribute"),
    Column("rated", "rated", "1", "People's ratings of this profile, 0 to 100"),
    Column("predicted", "predicted", "1"),
    Column("interval", "90 % interval"),
    Column("recovered", "recovered", "1", "The forward model about the profile that was made of the prediction"),
    Column("felt", "felt", "1", "Fresh simulated people about the made profile"),
)


def report_html(evaluation: DoorEvaluation, pictured: Sequence[DrawnFigure] = ()) -> str:
    """Return the whole page as one text. Every name in it is escaped."""
    sections = (
        in_short(evaluation), forward_section(evaluation, pictured), inverse_section(evaluation, pictured),
        measured_section(evaluation, pictured), provenance(evaluation),
    )  # fmt: skip
    whole = [section for section in sections if section is not None]
    return page_html(Page(TITLE, LEAD, banners(evaluation), facts(evaluation), whole), EVALUATION)


def banners(evaluation: DoorEvaluation) -> list[str]:
    """Return what has to be known before any number is read."""
    known = [words.LINEAR] if evaluation.data.simulated else []
    known += [words.QUICK] if evaluation.results.options.quick else []
    return [*known, words.LEAKY] if evaluation.results.options.split == "leaky" else known


def facts(evaluation: DoorEvaluation) -> list[tuple[str, str]]:
    """Return what stands at the head of the page."""
    data, results = evaluation.data, evaluation.results
    raters = sorted({int(count) for count in data.raters})
    people = "not known" if raters[0] == 0 else f"{raters[0]}" if len(raters) == 1 else f"{raters[0]} to {raters[-1]}"
    folds = results.domain.splits[results.options.split]
    return [
        ("Stimuli", f"{len(data):,} of {len(set(data.doors))} doors"),
        ("Raters of each", people),
        ("Split", f"{words.SPLITS[results.options.split]}, {len(folds)}"),
        ("Methods", f"{len(evaluation.forward)} forward, {len(evaluation.inverse)} inverse"),
        ("Data, SHA-256", data.digest[:12]),
    ]


def in_short(evaluation: DoorEvaluation) -> Section:
    """Return the default methods and why, and what was set out to be reached."""
    points: list[tuple[str, str]] = []
    named = {"forward": "From force to feeling", "inverse": "From feeling to force"}
    for way, choice in evaluation.choices.items():
        points.append((named[way], f"Default: {choice.method}. {choice.why}"))
        points += [("The thesis' network", sentence) for sentence in choice.of_ours]
    points += reached(evaluation)
    return Section("short", "In short", (Points(tuple(points)),))


def reached(evaluation: DoorEvaluation) -> list[tuple[str, str]]:
    """Return the targets beside what was reached, each with its name."""
    points: list[tuple[str, str]] = []
    if "forward" in evaluation.choices:
        row = _row(evaluation.forward, evaluation.choices["forward"].method)
        is_reached = (
            row["mae"] <= TARGETS["mae"] and row["rmse"] <= TARGETS["rmse"] and (row["r2"] or 0) >= TARGETS["r2"]
        )
        ceiling = ""
        if evaluation.ceilings:
            least = evaluation.ceilings[0].mae[-1]
            ceiling = f" A perfect predictor's MAE would be {least:.2f}, as the ratings are noisy means."
        ratings = (
            f"Of unseen stimuli: MAE {row['mae']:.2f} (aim: at most {TARGETS['mae']:g}), RMSE "
            f"{row['rmse']:.2f} ({TARGETS['rmse']:g}), R² {written(row['r2'], '3')} (at least {TARGETS['r2']:g}): "
            f"{_reached_or_not(is_reached)}.{ceiling}"
        )
        points.append(("Ratings", ratings))
    if "inverse" in evaluation.choices:
        row = _row(evaluation.inverse, evaluation.choices["inverse"].method)
        points += [("The loop", text) for text in _loop_reached(row)]
        points += [("Waveform", _waveform_reached(evaluation, row))]
        if row["corners"] is not None:
            of = f"Of the {row['corners']:.0f} wishes with every slider at an end"
            points.append(("Corners", f"{of}, {row['corners_unplayable']:.0f} come to a profile beyond the limits."))
    return points


def _reached_or_not(is_reached: bool) -> str:
    return "reached" if is_reached else "not reached"


def _loop_reached(row: Row) -> list[str]:
    for name, whose in (
        ("loop_fresh", "simulated people who saw no training data find"),
        ("loop_judge", "the forward model judges"),
    ):
        if row[name] is not None:
            counts = row[name] if row["loop_attainable"] is None else row["loop_attainable"]
            verdict, off = _reached_or_not(counts <= TARGETS["loop"]), f"off by {row[name]:.2f} an attribute"
            some = "" if row["loop_attainable"] is None else f", {counts:.2f} where the wish can be had"
            return [f"As {whose} it: {off}{some} (aim: at most {TARGETS['loop']:g}): {verdict}."]
    return []


def _waveform_reached(evaluation: DoorEvaluation, row: Row) -> str:
    oracle = next(
        (r for r in evaluation.floors if r["floor"] == "oracle" and r["split"] == evaluation.results.options.split),
        None,
    )
    floor = (
        "" if oracle is None
        else f" An oracle that knows the very waveform and takes the nearest known one has {oracle['mae']:.2f} %."
    )  # fmt: skip
    verdict = _reached_or_not(row["waveform_mae"] <= TARGETS["waveform"])
    return f"Error {row['waveform_mae']:.2f} % (aim: at most {TARGETS['waveform']:g} %): {verdict}.{floor}"


def _row(rows: Sequence[Row], method: str) -> Row:
    return next(row for row in rows if row["method"] == method)


def measured_section(evaluation: DoorEvaluation, pictured: Sequence[DrawnFigure]) -> Section | None:
    """Return the measured door and its edits: predicted, and recovered."""
    if not evaluation.measured:
        return None
    blocks: list[Block] = [
        Words(words.MEASURED),
        *(figure_block(figure) for figure in chosen(pictured, "measured_door")),
    ]
    blocks += [_measured_table(evaluation, profile) for profile in evaluation.measured]
    return Section("measured", "The measured door", tuple(blocks))


def _measured_table(evaluation: DoorEvaluation, profile: Recovered) -> TableBlock:
    rows = [_measured_row(evaluation, profile, i) for i in range(len(evaluation.data.attributes))]
    off = float(abs(profile.again - profile.predicted).mean())
    why = f" The door would refuse the made profile: {profile.why}." if profile.why else ""
    note = f"Recovered within {off:.1f} an attribute on average.{why}"
    return table(profile_name(profile.name), rows, MEASURED, note=note)


def _measured_row(evaluation: DoorEvaluation, profile: Recovered, i: int) -> Row:
    reach = None if profile.half_width is None else float(profile.half_width[i])
    p = float(profile.predicted[i])
    return {
        "attribute": f"{evaluation.data.attributes[i]} – {evaluation.data.antonyms[i]}",
        "rated": None if profile.rated is None else float(profile.rated[i]),
        "predicted": p,
        "interval": NONE if reach is None else f"{p - reach:.1f} to {p + reach:.1f}".replace("-", "−"),
        "recovered": float(profile.again[i]),
        "felt": None if profile.felt is None else float(profile.felt[i]),
    }


def profile_name(name: str) -> str:
    """Return a measured profile as the report calls it."""
    return "The measured door" if name == "actual" else name.replace("edited_v", "Edit, version ")


def provenance(evaluation: DoorEvaluation) -> Section:
    """Return the section that names the inputs, the run and the software."""
    results, domain = evaluation.results, evaluation.results.domain
    inputs: list[Row] = [{"input": line} for line in domain.data.made_from]
    (low, high), (least, most) = domain.scaling.rating, domain.scaling.force_N
    run = (
        f"Seed {results.options.seed}. {len(results.jobs)} trainings, {results.jobs.loaded} of them taken from an "
        f"earlier, equal evaluation; the rest took {in_seconds(results.seconds)} here."
    )
    blocks: list[Block] = [
        Words(words.SCALING.format(low=low, high=high, least=least, most=most)),
        Words(run),
        Words(words.UNROUNDED),
        table("Inputs and their SHA-256", inputs, [Column("input", "input", "words")], folded=len(inputs) > 6),
        software_table(),
    ]
    return Section("provenance", "Provenance", tuple(blocks))
