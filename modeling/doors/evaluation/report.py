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
from palpate.modeling.doors.measured_door import measured_rows
from palpate.modeling.evaluate.outputs import software_table

TITLE = "Car doors: how well feelings are predicted, and profiles made"
TARGETS = {"mae": 3.5, "rmse": 5.0, "r2": 0.85, "loop": 5.0, "waveform": 1.0}
"""The project's targets, on 0..100 and in percent."""
MEASURED = (
    Column("attribute", "attribute"),
    Column("rated", "rated", "1", "People's ratings of this profile, 0 to 100"),
    Column("predicted", "predicted", "1"),
    Column("interval", "90 % interval"),
    Column("recovered", "recovered", "1", "The forward model about the profile that was made of the prediction"),
    Column("felt", "felt", "1", "Fresh simulated people about the made profile"),
)


def report_html(evaluation: DoorEvaluation, pictured: Sequence[DrawnFigure] = ()) -> str:
    """Return the whole page as HTML, with all names escaped."""
    sections = (
        in_short(evaluation), forward_section(evaluation, pictured), inverse_section(evaluation, pictured),
        measured_section(evaluation, pictured), provenance(evaluation),
    )  # fmt: skip
    whole = [section for section in sections if section is not None]
    return page_html(Page(TITLE, LEAD, banners(evaluation), facts(evaluation), whole), EVALUATION)


def banners(evaluation: DoorEvaluation) -> list[str]:
    """Return the warnings at the head of the page."""
    known = [words.LINEAR] if evaluation.data.simulated else []
    known += [words.QUICK] if evaluation.results.options.quick else []
    return [*known, words.LEAKY] if evaluation.results.options.split == "leaky" else known


def facts(evaluation: DoorEvaluation) -> list[tuple[str, str]]:
    """Return the facts at the head of the page, each with its name."""
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
    """Return the section with the default methods, the reasons, and the targets."""
    points: list[tuple[str, str]] = []
    named = {"forward": "From force to feeling", "inverse": "From feeling to force"}
    for way, choice in evaluation.choices.items():
        points.append((named[way], f"Default: {choice.method}. {choice.why}"))
        points += [("The thesis' network", sentence) for sentence in choice.of_ours]
    points += reached(evaluation)
    return Section("short", "In short", (Points(tuple(points)),))


def reached(evaluation: DoorEvaluation) -> list[tuple[str, str]]:
    """Return the targets with their results, as labels and sentences."""
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
            f"{_verdict(is_reached)}.{ceiling}"
        )
        points.append(("Ratings", ratings))
    if "inverse" in evaluation.choices:
        row = _row(evaluation.inverse, evaluation.choices["inverse"].method)
        points += [("The loop", text) for text in _loop_result(row)]
        points += [("Waveform", _waveform_result(evaluation, row))]
        if row["corners"] is not None:
            of = f"Of the {row['corners']:.0f} wishes with every slider at an end"
            points.append(("Corners", f"{of}, {row['corners_unplayable']:.0f} come to a profile beyond the limits."))
    return points


def _verdict(is_reached: bool) -> str:
    return "reached" if is_reached else "not reached"


def _loop_result(row: Row) -> list[str]:
    for name, whose in (
        ("loop_fresh", "simulated people who saw no training data find"),
        ("loop_judge", "the forward model judges"),
    ):
        if row[name] is not None:
            counts = row[name] if row["loop_attainable"] is None else row["loop_attainable"]
            verdict, off = _verdict(counts <= TARGETS["loop"]), f"off by {row[name]:.2f} an attribute"
            some = "" if row["loop_attainable"] is None else f", {counts:.2f} where the wish can be had"
            return [f"As {whose} it: {off}{some} (aim: at most {TARGETS['loop']:g}): {verdict}."]
    return []


def _waveform_result(evaluation: DoorEvaluation, row: Row) -> str:
    oracle = next(
        (r for r in evaluation.floors if r["floor"] == "oracle" and r["split"] == evaluation.results.options.split),
        None,
    )
    floor = (
        "" if oracle is None
        else f" An oracle that knows the very waveform and takes the nearest known one has {oracle['mae']:.2f} %."
    )  # fmt: skip
    verdict = _verdict(row["waveform_mae"] <= TARGETS["waveform"])
    return f"Error {row['waveform_mae']:.2f} % (aim: at most {TARGETS['waveform']:g} %): {verdict}.{floor}"


def _row(rows: Sequence[Row], method: str) -> Row:
    return next(row for row in rows if row["method"] == method)


def measured_section(evaluation: DoorEvaluation, pictured: Sequence[DrawnFigure]) -> Section | None:
    """Return the section of the measured door and its edits: predicted and recovered ratings."""
    if not evaluation.measured:
        return None
    blocks: list[Block] = [
        Words(words.MEASURED),
        *(figure_block(figure) for figure in chosen(pictured, "measured_door")),
    ]
    data = evaluation.data
    for profile in evaluation.measured:
        rows = measured_rows((profile,), data.attributes)
        for row, antonym in zip(rows, data.antonyms, strict=True):
            interval = NONE if row["low"] is None else f"{row['low']:.1f} to {row['high']:.1f}".replace("-", "−")
            row |= {"attribute": f"{row['attribute']} – {antonym}", "interval": interval}
        off = float(abs(profile.recovered - profile.predicted).mean())
        why = f" The door would refuse the made profile: {profile.why}." if profile.why else ""
        note = f"Recovered within {off:.1f} an attribute on average.{why}"
        blocks.append(table(profile_name(profile.name), rows, MEASURED, note=note))
    return Section("measured", "The measured door", tuple(blocks))


def profile_name(name: str) -> str:
    """Return the name of a measured profile in the report."""
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
