"""The report of an evaluation of predicted attributes: one HTML file."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.analysis.reports.figures import DrawnFigure, figure_block
from palpate.analysis.reports.figures import chosen as pictures
from palpate.analysis.reports.page import EVALUATION, Block, Column, Heading, Page, Section, Words, page_html, table
from palpate.analysis.reports.tables import in_seconds
from palpate.modeling.attributes.evaluation import words
from palpate.modeling.attributes.evaluation.evaluate import RULE, AttributeEvaluation, choice, fusion
from palpate.modeling.attributes.evaluation.tables import (
    Row,
    Which,
    attribute_rows,
    class_rows,
    fold_rows,
    method_rows,
    names_of,
    number_of,
    table_rows,
)
from palpate.modeling.attributes.joining import missing_modalities
from palpate.modeling.evaluate.outputs import Choice, software_table

OVERALL = (
    Column("title", "method"),
    Column("mae", "MAE", "2", "Mean over textures and attributes, 0 to 100", "low"),
    Column("rmse", "RMSE", "2", "Mean over the attributes, 0 to 100", "low"),
    Column("within_jnd", "within JND", "share", "Predictions no more than 10 off, what people just notice", "high"),
    Column("best_more", "more than the best", "text", "Paired difference of MAE, with its interval"),
    Column("ours_more", "than the thesis' network", "text", "Paired difference of MAE, with its interval"),
    Column("half_width", "± width", "2", "Of 90 % intervals, mean over the attributes", "low"),
    Column("coverage", "coverage", "share", "Ratings within their 90 % interval"),
    Column("features_s", "features", "s", "Of one texture"),
    Column("train_s", "training", "s", "Of one fold", "low"),
    Column("answer_s", "answer", "s", "Of one texture", "low"),
)
FOUND = (Column("attribute", "attribute"), Column("mae", "MAE", "2"), Column("rmse", "RMSE", "2"),
         Column("within_jnd", "within JND", "share"), Column("half_width", "± 90 %", "2"))  # fmt: skip
FOLDS = (Column("test", "left out"), Column("known", "learned from", "int"),
         Column("held", "watched of these, by methods that stop early", "words"),
         Column("apart", "kept apart", "words"))  # fmt: skip
SOURCES = (Column("title", "method"), Column("method", "name"), Column("features", "features", "words"),
           Column("source", "source", "words"), Column("refused", "refused", "words"))  # fmt: skip


def report_html(evaluation: AttributeEvaluation, pictured: Sequence[DrawnFigure] = ()) -> str:
    """Return the report as HTML, with all names escaped."""
    chosen = choice_of(evaluation)
    every = (
        chosen.section(RULE, reached(evaluation)), methods_section(evaluation, chosen),
        features_section(evaluation, chosen), textures_section(evaluation, pictured, chosen), time_section(pictured),
        provenance(evaluation),
    )  # fmt: skip
    sections = tuple(section for section in every if section is not None)
    return page_html(Page(words.TITLE, words.LEAD, banners(evaluation), facts(evaluation), sections), EVALUATION)


def choice_of(evaluation: AttributeEvaluation) -> Choice:
    """Return the default method and the reason."""
    return choice(method_rows(evaluation))


def banners(evaluation: AttributeEvaluation) -> list[str]:
    """Return the warnings to show before any number."""
    lines = [words.SIMULATED] if evaluation.material.simulated else []
    if evaluation.options.quick:
        lines.append(words.QUICK.format(count=len(evaluation.tested)))
    elif evaluation.options.epochs is not None:
        lines.append(words.FEW_EPOCHS.format(epochs=evaluation.options.epochs))
    if evaluation.options.early_stopping:
        lines.append(words.EARLY)
    if len(evaluation.tested) < len(evaluation.material.textures) and not evaluation.options.quick:
        lines.append(words.FEW_FOLDS.format(count=len(evaluation.tested), textures=len(evaluation.material.textures)))
    if evaluation.material.weights and any("resnet" in entry.sight for entry in evaluation.entries):
        lines.append(words.WEIGHTS.format(weights=evaluation.material.weights))
    lines += [*missing_modalities(evaluation.material), *(f"Not used: {line}." for line in evaluation.unused())]
    joined = sorted({(fold.test, *fold.apart) for fold in evaluation.domain.folds.values() if fold.apart})
    groups = "; ".join(sorted({", ".join(sorted(group)) for group in joined}))
    return lines + ([words.APART.format(groups=groups)] if groups else [])


def facts(evaluation: AttributeEvaluation) -> list[tuple[str, str]]:
    """Return the facts at the head of the page, as labels and texts."""
    raters = sorted({texture.rated.raters for texture in evaluation.material.textures if texture.rated is not None})
    people = " to ".join(f"{number}" if number else "not told" for number in sorted({raters[0], raters[-1]}))
    return [
        ("Textures", f"{len(evaluation.material.textures)}"),
        ("Left out, once each", f"{len(evaluation.tested)}"),
        ("People", people),
        ("Methods", f"{len(method_rows(evaluation))}"),
        ("Data, SHA-256", evaluation.domain.digest[:12]),
    ]


def reached(evaluation: AttributeEvaluation) -> list[tuple[str, str]]:
    """Return the targets with the results, as labels and sentences."""
    rows = method_rows(evaluation)
    points = [("Ours", line) for line in choice(rows).of_ours]
    both = fusion(rows)
    return points if both is None else [*points, both]


def methods_section(evaluation: AttributeEvaluation, chosen: Choice) -> Section:
    """Return the section that compares all methods, with Tables 3.2 and 3.3."""
    rows = [
        {**row, **{f"{name}_more": _more(row, name) for name in ("best", "ours")}} for row in method_rows(evaluation)
    ]
    blocks: list[Block] = [
        Words(words.FOLDS),
        table("Error and time", rows, OVERALL, ours=chosen.method, note=f"{words.DIFFERENCES} {words.TIMES}"),
        *([] if evaluation.times else [Words(words.NO_FEATURE_TIMES, "note")]),
        _numbered(evaluation, "mae", "MAE", words.MAE_NOTE, chosen),
        _numbered(evaluation, "rmse", "RMSE", words.RMSE_NOTE, chosen),
    ]
    refused = [row for row in rows if row["refused"]]
    if refused:
        blocks.append(table("Not evaluated", refused, [Column("title", "method"), Column("refused", "why", "words")]))
    return Section("methods", "All methods", tuple(blocks))


def _more(row: Row, name: str) -> str | None:
    mean, low, high = (row[f"{name}_{end}"] for end in ("less", "low", "high"))
    if mean is None:
        return None
    if low is None or high is None:
        return f"{mean:+.2f}".replace("-", "−")
    ends = f"{low:+.2f} to {high:+.2f}"
    return f"{mean:+.2f} ({ends}){', chance?' if row[f'{name}_chance'] else ''}".replace("-", "−")


def _numbered(evaluation: AttributeEvaluation, which: Which, measure: str, note: str, chosen: Choice) -> Block:
    rows = table_rows(evaluation, which)
    cells = [Column(name, name, "2", "", "low") for name in (*names_of(evaluation), "mean")]
    first = [Column("title", "method")]
    if which == "kinds":
        first.append(Column("features", "features"))
    title = f"Table {number_of(which)}, {measure}"
    return table(title, rows, [*first, *cells], note=note.format(count=len(evaluation.tested)), ours=chosen.method)


def features_section(evaluation: AttributeEvaluation, chosen: Choice) -> Section | None:
    """Return the section of Tables 3.4 and 3.5; None where they were not requested."""
    if not evaluation.options.ablations:
        return None
    blocks = (
        Words(words.BRANCHES),
        _numbered(evaluation, "same_features", "RMSE", words.SAME, chosen),
        _numbered(evaluation, "kinds", "RMSE", words.KINDS, chosen),
    )
    return Section("features", "Methods and features apart", blocks)


def textures_section(evaluation: AttributeEvaluation, pictured: Sequence[DrawnFigure], chosen: Choice) -> Section:
    """Return the section of Figures 3.8 and 3.9, the errors by attribute and class, and the intervals."""
    rows = [row for row in attribute_rows(evaluation) if row["method"] == chosen.method]
    title = rows[0]["title"] if rows else chosen.method
    classes = [{**row, "class": row["class"].replace("_", " ")} for row in class_rows(evaluation)
               if row["method"] == chosen.method and row["attribute"] == "all"]  # fmt: skip
    by_class = (Column("class", "class"), Column("textures", "textures", "int"), *FOUND[1:4])
    drawn = pictures(pictured, "figure_3_8", "scatter_3_8", "figure_3_9")
    blocks: tuple[Block, ...] = (
        table(f"{title} by attribute", rows, FOUND, note=words.INTERVALS),
        *(
            figure_block(figure, "Figure 3.9" if figure.name.startswith("figure_3_9") else "Figure 3.8")
            for figure in drawn
        ),
        table(f"{title} by class", classes, by_class, folded=True),
    )
    return Section("textures", "Textures and classes", blocks)


def time_section(pictured: Sequence[DrawnFigure]) -> Section | None:
    """Return the section of error against time and learning curves; None where nothing was drawn."""
    blocks = tuple(figure_block(figure) for figure in pictures(pictured, "work_precision", "learning_"))
    return Section("time", "Time", blocks) if blocks else None


def provenance(evaluation: AttributeEvaluation) -> Section:
    """Return the section that names the inputs, the run and the software."""
    notes: list[Row] = [{"texture": texture.label, "notes": "; ".join(texture.notes) or None}
                        for texture in evaluation.material.textures if texture.notes]  # fmt: skip
    jobs, loaded = len(evaluation.results), evaluation.results.loaded
    run = f"Seed {evaluation.options.seed}. {jobs} trainings, {loaded} of them taken from earlier, equal evaluations; "
    blocks: list[Block] = [Words(f"{run}{in_seconds(evaluation.seconds)} here."), Words(words.UNROUNDED)]
    blocks += [Words(note) for note in evaluation.material.notes]
    blocks.append(table("Methods and their sources", method_rows(evaluation), SOURCES))
    blocks.append(table("Folds", fold_rows(evaluation), FOLDS, folded=True))
    if notes:
        columns = [Column("texture", "texture"), Column("notes", "notes", "words")]
        blocks += [Heading("Textures"), table("What was noticed", notes, columns, folded=len(notes) > 6)]
    blocks.append(software_table())
    return Section("provenance", "Provenance", tuple(blocks))
