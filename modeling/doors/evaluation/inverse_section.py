"""The report's section about making a force profile from wished ratings."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.analysis.reports.figures import DrawnFigure, chosen, figure_block
from palpate.analysis.reports.page import Block, Column, Heading, Section, TableBlock, Words, table
from palpate.modeling.doors.evaluation import words
from palpate.modeling.doors.evaluation.evaluate import DoorEvaluation
from palpate.modeling.doors.evaluation.forward_section import with_refusals
from palpate.modeling.doors.evaluation.method_rows import attainable, loop_rows
from palpate.modeling.doors.evaluation.result_tables import corner_rows, plausible_row, slider_rows, splits_inverse
from palpate.modeling.doors.evaluation.tables import OVERALL, Row, printed_waveforms, waveform_rows
from palpate.modeling.doors.registry import THESIS
from palpate.modeling.doors.results import MethodResults
from palpate.signals.doors.limits import LIMIT_N, STEEPEST_N_DEG

ERRORS = (
    Column("title", "method"),
    Column(
        "loop_fresh",
        "loop, fresh people",
        "2",
        "Wished ratings against those of people who saw no training data",
        "low",
    ),
    Column("loop_attainable", "attainable wishes", "2", "The same where the wish can be had", "low"),
    Column("attainable", "so many", "int", "Wishes that some method meets within 10 in every attribute"),
    Column("loop_judge", "loop, forward model", "2", "Wished ratings against the forward model's, 0 to 100", "low"),
    Column("waveform_mae", "waveform MAE, %", "2", "Of the range of all forces", "low"),
    Column("waveform_mae_sd", "± SD", "2", "Over profiles"),
    Column("waveform_rmse", "RMSE, %", "2", "", "low"),
    Column("unplayable", "beyond the limits", "int", "Made profiles beyond the limits of what may be made", "low"),
    Column("made", "of", "int"),
    Column("corners_unplayable", "corners beyond", "int", "Of all corners of the sliders", "low"),
    Column("corners", "of", "int"),
)
TIMES = (
    Column("title", "method"),
    Column("loop", "loop", "2", "By fresh people where there are any, else by the forward model, 0 to 100", "low"),
    Column("train_s", "training", "s", "All folds together, without the forward model it builds on", "low"),
    Column("forward_s", "its forward model", "s", "Training of the forward model that it builds on"),
    Column("file_ms", "answer, ms", "ms", "Median", "low"),
    Column("file_p99_ms", "p99, ms", "ms"),
    Column("without_file_ms", "without a file, ms", "ms", "An answer of the trained model: its share of all at once"),
    Column("file_bytes", "file", "bytes", "", "low"),
    Column("file_difference", "off, %", "tiny", "Largest difference of the file's answers from the trained model's"),
    Column("source", "source", "words"),
)
SLIDERS = (
    Column("method", "method"),
    Column("attribute", "attribute"),
    Column("at_10", "wished 10", "1"),
    Column("at_90", "wished 90", "1"),
    Column("moved", "moved", "1", "80 was wished"),
    Column("others_moved", "others moved", "1", "Mean of the other attributes; 0 was wished"),
)
PLAUSIBLE = (
    Column("method", "method"),
    Column("unplayable", "beyond the limits", "int"),
    Column("made", "of", "int"),
    Column("greatest_N_max", "force, N", "1", "The greatest of all made profiles"),
    Column("steepest_N_deg_max", "slope, N/deg", "1", "The greatest of all made profiles"),
    Column("work_J_m_mean", "work, J/m", "2", "Of opening, for each metre of handle radius, mean"),
    Column("distance_N_mean", "to the nearest, N", "2", "Mean absolute difference to the nearest known profile, mean"),
    Column("beyond_mean", "farther out than", "share", "Share of known profiles with a nearer neighbour, mean"),
)
CORNERS = (
    Column("method", "method"),
    Column("corners", "corners", "int"),
    Column("corners_unplayable", "beyond the limits", "int", "", "low"),
    Column("corners_had", "had", "int", "Every attribute within 10 of the wish"),
    Column("corners_off", "off", "1", "Mean distance of the nearest found ratings from the wish"),
    Column("corners_greatest_N", "force, N", "1"),
    Column("corners_steepest_N_deg", "slope, N/deg", "1"),
)
JUDGES = {
    "loop_fresh": "As rated by simulated people who never saw the training data",
    "loop_attainable": "The same, wishes alone that can be had",
    "loop_judge": "As the forward model judges it",
    "loop_felt": "The same people without bias, gain, noise and steps",
}


def inverse_section(evaluation: DoorEvaluation, pictured: Sequence[DrawnFigure]) -> Section | None:
    """Return the section of the inverse methods; None where none was evaluated."""
    if not evaluation.inverse:
        return None
    ours = evaluation.choices["inverse"].method
    rows = list(evaluation.inverse)
    timed = [
        {
            **row,
            "loop": row["loop_judge"] if row["loop_fresh"] is None else row["loop_fresh"],
            "without_file_ms": row["trained_ms"] if row["file_ms"] is None else None,
        }
        for row in rows
    ]
    sliders = [row for method in _in_full(evaluation, ours) for row in slider_rows(method)]
    title = "One slider at 10 and at 90, the others at 50 (thesis 5.7.1)"
    blocks: list[Block] = [
        Words(words.WISHES),
        table(
            "All methods on the same folds: error",
            rows,
            ERRORS,
            ours=ours,
            note=words.LIMITS.format(force=LIMIT_N, slope=STEEPEST_N_DEG),
        ),
        table("Error and time", timed, TIMES, ours=ours, note=with_refusals(words.TIMES, rows)),
        *(figure_block(figure) for figure in chosen(pictured, "work_precision_inverse", "made_profiles")),
        *_loop(evaluation),
        *([table(title, sliders, SLIDERS, folded=True, note=words.SLIDERS)] if sliders else []),
        *_waveforms(evaluation, ours),
        *(figure_block(figure, "Figure 5.14") for figure in chosen(pictured, "figure_5_14")),
        *_floors(evaluation),
        *_plausibility(evaluation, ours),
        *(figure_block(figure) for figure in chosen(pictured, "learning_inverse")),
    ]
    return Section("inverse", "From feeling to force", tuple(blocks))


def _title(evaluation: DoorEvaluation, method: str) -> str:
    return evaluation.results.domain.methods["inverse"][method].title


def _loop(evaluation: DoorEvaluation) -> list[Block]:
    """Return the loop's error by attribute: a table for each judge, a column for each method."""
    methods = evaluation.results.methods("inverse")
    within = attainable(methods)
    notes = {"loop_fresh": words.FRESH, "loop_attainable": words.ATTAINABLE, "loop_judge": words.JUDGE}
    columns = [Column("attribute", "attribute"), *(Column(results.method, results.method, "2") for results in methods)]
    blocks: list[Block] = [Heading("The loop, by attribute", "loop")]
    for name, title in JUDGES.items():
        rows: list[Row] = [{"attribute": attribute} for attribute in (*evaluation.data.attributes, "mean")]
        for method in methods:
            values = [row[name] for row in loop_rows(method, within)]
            if any(value is None for value in values):
                continue
            for row, value in zip(rows, [*values, sum(values) / len(values)], strict=True):
                row[method.method] = value
        if any(len(row) > 1 for row in rows):
            folded = name == "loop_felt"
            blocks.append(table(title, rows, columns, folded=folded, note=notes.get(name, "")))
    return blocks


def _in_full(evaluation: DoorEvaluation, ours: str) -> list[MethodResults]:
    """Return the results of the default method, and of the thesis' network if that is another."""
    methods = [method for method in evaluation.results.methods("inverse") if method.method in (ours, THESIS)]
    return sorted(methods, key=lambda results: results.method != ours)


def _waveforms(evaluation: DoorEvaluation, ours: str) -> list[Block]:
    """Return table 5.6 for the default and the thesis' network, those of other methods folded, with the thesis' own."""
    shown = _in_full(evaluation, ours)
    others = [method for method in evaluation.results.methods("inverse") if method.method not in (ours, THESIS)]
    blocks: list[Block] = [Heading("The waveform, by door", "waveforms")]
    blocks += [_by_door(evaluation, results, folded=False) for results in shown]
    blocks += [_by_door(evaluation, results, folded=True) for results in others]
    columns = [Column("variant", "variant"), Column("mae_sd", "MAE, % ± SD"), Column("rmse_sd", "RMSE, % ± SD"),
               Column("n", "profiles", "int")]  # fmt: skip
    for results in shown:
        rows = [_spreads(row) for row in waveform_rows(results, "variants") if row["variant"] != OVERALL]
        blocks.append(table(f"By variant: {_title(evaluation, results.method)}", rows, columns, folded=True))
    return blocks


def _by_door(evaluation: DoorEvaluation, method: MethodResults, folded: bool) -> TableBlock:
    theirs = printed_waveforms().by_door
    rows = [_spreads(row) for row in waveform_rows(method)]
    for row in rows:
        if printed := theirs.get(row["door"]):
            row |= {f"thesis_{name}": _pm(printed[name], printed[f"{name}_sd"], 3) for name in ("mae", "rmse")}
    rows[-1]["door"] = "all" if rows[-1]["door"] == OVERALL else rows[-1]["door"]
    columns = [
        *(Column("door", "door"), Column("mae_sd", "MAE, % ± SD"), Column("rmse_sd", "RMSE, % ± SD")),
        *(Column("n", "profiles", "int"), Column("thesis_mae", "thesis' MAE*"), Column("thesis_rmse", "thesis' RMSE*")),
    ]
    note = "" if folded else f"* {words.PRIVATE}"
    title = f"Table 5.6. {_title(evaluation, method.method)}"
    return table(title, rows, columns, folded=folded, note=note, theirs=("thesis_mae", "thesis_rmse"))


def _spreads(row: Row) -> Row:
    """Return the row with its means and SDs as one text each."""
    return {**row, **{f"{name}_sd": _pm(row[name], row[f"{name}_sd"], 2) for name in ("mae", "rmse")}}


def _pm(mean: float, sd: float | None, digits: int) -> str:
    return f"{mean:.{digits}f}" if sd is None else f"{mean:.{digits}f} ± {sd:.{digits}f}"


def _floors(evaluation: DoorEvaluation) -> list[Block]:
    """Return the waveform's error by split beside its floors, which explain the thesis' 0.6 %."""
    wide: dict[str, Row] = {}
    for row in splits_inverse(evaluation):
        wide.setdefault(row["method"], {"title": _title(evaluation, row["method"])})[row["split"]] = row["mae"]
    for row in evaluation.floors:
        wide.setdefault(row["floor"], {"title": f"floor: {row['what']}"})[row["split"]] = row["mae"]
    columns = [Column("title", "method"), *(Column(name, text, "2") for name, text in words.SPLITS.items())]
    note = words.FLOORS.format(theirs=printed_waveforms().overall("mae"))
    return [
        Heading("How small can the waveform's error be?", "floors"),
        table("Waveform MAE by split, and floors", list(wide.values()), columns, note=note),
    ]


def _plausibility(evaluation: DoorEvaluation, ours: str) -> list[Block]:
    methods = evaluation.results.methods("inverse")
    rows = [plausible_row(method) for method in methods]
    return [
        Heading("Could it be a door?", "plausibility"),
        table(
            "Made profiles", rows, PLAUSIBLE, ours=ours, note=words.LIMITS.format(force=LIMIT_N, slope=STEEPEST_N_DEG)
        ),
        table("All corners: every slider at 0 or 100", corner_rows(methods), CORNERS, ours=ours, note=words.CORNERS),
    ]
