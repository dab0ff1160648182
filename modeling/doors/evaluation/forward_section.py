"""The report's section about predicting ratings from a force profile."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.analysis.reports.figures import DrawnFigure, chosen, figure_block
from palpate.analysis.reports.page import Block, Column, Heading, Section, Words, table
from palpate.modeling.doors.evaluation import words
from palpate.modeling.doors.evaluation.evaluate import DoorEvaluation
from palpate.modeling.doors.evaluation.result_tables import ceiling_rows, splits_forward
from palpate.modeling.doors.evaluation.tables import AVERAGE, Row, cell_rows, printed, thesis_rows, variant_rows
from palpate.modeling.doors.registry import THESIS
from palpate.modeling.doors.results import MethodResults
from palpate.modeling.evaluate.intervals import COVERAGE

TABLES = (("mae", "5.3", "MAE", "2"), ("rmse", "5.4", "RMSE", "2"), ("r2", "5.5", "R²", "3"))
ERRORS = (
    Column("title", "method"),
    Column("mae", "MAE", "2", "Mean absolute error, 0 to 100 (equation 5.5)", "low"),
    Column("mae_of_folds_sd", "± folds", "2", "SD of the folds' MAE"),
    Column("rmse", "RMSE", "2", "Root mean square error, 0 to 100 (equation 5.6)", "low"),
    Column("r2", "R²", "3", "Equation 5.7, around each attribute's mean", "high"),
    Column("within_jnd", "within JND", "share", "Predictions no more than 10 off, what people just notice", "high"),
    Column("within_sd", "within ± 1 SD", "share", "Predictions within one SD of the raters of that stimulus", "high"),
    Column("coverage", "coverage", "share", f"New ratings within their interval; {COVERAGE:.0%} is wanted"),
    Column("half_width", "± width", "2", "Mean half width of these intervals, 0 to 100", "low"),
    Column("scaled_coverage", "coverage, scaled", "share", "Of intervals that are scaled by the model's own SD"),
)
TIMES = (
    Column("title", "method"),
    Column("mae", "MAE", "2", "0 to 100", "low"),
    Column("train_s", "training", "s", "All folds together", "low"),
    Column("file_ms", "answer, ms", "ms", "Median", "low"),
    Column("file_p99_ms", "p99, ms", "ms"),
    Column("file_bytes", "file", "bytes", "The exported model: card and weights", "low"),
    Column("file_difference", "off, %", "tiny", "Largest difference of the file's answers from the trained model's"),
    Column("source", "source", "words"),
)
CEILING = (
    Column("reliability", "reliability", "3", "Spearman-Brown, from split halves of the raters"),
    Column("mae", "MAE", "2"),
    Column("rmse", "RMSE", "2"),
    Column("r2", "R²", "3"),
)
KNOWS = {"other_people": "everybody who could be asked", "same_people": "these people's habits"}


def forward_section(evaluation: DoorEvaluation, pictured: Sequence[DrawnFigure]) -> Section | None:
    """Return the section of the forward methods; None where none was evaluated."""
    if not evaluation.forward:
        return None
    ours = evaluation.choices["forward"].method
    averages = {name: printed(name).overall for name, *_ in TABLES}
    blocks: list[Block] = [
        Words(words.RULES[evaluation.results.options.split]),
        table(
            "All methods on the same folds: error",
            [*evaluation.forward, {"method": "", "title": "thesis' network*", **averages}],
            ERRORS,
            ours=ours,
            note=f"* {words.PRIVATE}",
        ),
        table(
            "Error and time",
            list(evaluation.forward),
            TIMES,
            ours=ours,
            note=with_refusals(words.TIMES, evaluation.forward),
        ),
        *(figure_block(figure) for figure in chosen(pictured, "work_precision_forward")),
        *_ceilings(evaluation),
        *_cells(evaluation, ours),
        *(
            figure_block(figure, figure.name.replace("figure_", "Figure ").replace("_", "."))
            for figure in chosen(pictured, "figure_5_12", "figure_5_13")
        ),
        *_variants(evaluation, ours),
        *_splits(evaluation),
        *(figure_block(figure) for figure in chosen(pictured, "learning_forward")),
    ]
    return Section("forward", "From force to feeling", tuple(blocks))


def with_refusals(note: str, rows: Sequence[Row]) -> str:
    """Return the note, followed by the reason of each method that has no file."""
    return " ".join([note, *(f"No file: {row['note']}" for row in rows if row["note"])])


def _ceilings(evaluation: DoorEvaluation) -> list[Block]:
    if not evaluation.ceilings:
        return [Words(f"Noise ceiling: {evaluation.no_ceiling}", "lead")]
    wide: list[Row] = [{"knows": KNOWS[ceiling.of], **ceiling_rows(ceiling)[-1]} for ceiling in evaluation.ceilings]
    by = ceiling_rows(evaluation.ceilings[0])[:-1]
    knows, attribute = Column("knows", "a perfect predictor that knows"), Column("attribute", "attribute")
    return [
        table("Noise ceiling", wide, [knows, *CEILING], note=words.CEILING),
        table(
            "Noise ceiling by attribute", by, [attribute, Column("half_r", "r of halves", "3"), *CEILING], folded=True
        ),
    ]


def _cells(evaluation: DoorEvaluation, ours: str) -> list[Block]:
    """Return tables 5.3 to 5.5 for the default and the thesis' network; those of other methods are folded."""
    blocks: list[Block] = [Heading("By attribute and door", "cells")]
    methods = sorted(
        evaluation.results.methods("forward"), key=lambda results: (results.method != ours, results.method != THESIS)
    )
    for measure, number, what, digits in TABLES:
        for method in methods:
            title = f"Table {number}. {what}: {_title(evaluation, method.method)}"
            folded = method.method not in (ours, THESIS)
            theirs = printed(measure)
            rows = cell_rows(method, measure)
            for row in rows[:-1]:
                row["thesis"] = theirs.by_attribute.get(row["attribute"])
            rows[-1]["thesis"] = theirs.overall
            columns = [
                *_door_columns(method, digits),
                Column("thesis", "thesis*", digits, "Private data, other people"),
            ]
            note = "" if folded else "* The thesis' average: private data, other people."
            blocks.append(table(title, rows, columns, folded=folded, note=note, theirs=("thesis",)))
        data = methods[0].data
        if thesis := thesis_rows(measure, data.attributes, list(dict.fromkeys(data.doors))):
            columns = _door_columns(methods[0], digits)
            theirs_only = [column.name for column in columns[1:]]
            title = f"Table {number} as the thesis printed it"
            blocks.append(table(title, thesis, columns, folded=True, note=words.PRIVATE, theirs=theirs_only))
    return blocks


def _door_columns(method: MethodResults, digits: str) -> list[Column]:
    doors = [Column(door, door, digits) for door in dict.fromkeys(method.data.doors)]
    return [Column("attribute", "attribute"), *doors, Column(AVERAGE, AVERAGE, digits)]


def _title(evaluation: DoorEvaluation, method: str) -> str:
    return evaluation.results.domain.methods["forward"][method].title


def _variants(evaluation: DoorEvaluation, ours: str) -> list[Block]:
    scores = [Column("mae", "MAE", "2"), Column("rmse", "RMSE", "2"), Column("r2", "R²", "3")]
    columns = [Column("variant", "variant"), *scores, Column("n", "stimuli", "int")]
    return [
        table(f"By variant: {_title(evaluation, method.method)}", variant_rows(method), columns, folded=True)
        for method in evaluation.results.methods("forward")
        if method.method in (ours, THESIS)
    ]


def _splits(evaluation: DoorEvaluation) -> list[Block]:
    """Return every method's MAE on each split, side by side."""
    by_method: dict[str, Row] = {}
    for row in splits_forward(evaluation):
        start: Row = {"method": row["method"], "title": _title(evaluation, row["method"])}
        by_method.setdefault(row["method"], start)[row["split"]] = row["mae"]
    columns = [
        Column("title", "method"),
        *(Column(name, text, "2", better="low") for name, text in words.SPLITS.items()),
    ]
    return [
        Heading("What the split does", "splits"),
        table("MAE by split", list(by_method.values()), columns, note=words.BY_SPLIT),
    ]
