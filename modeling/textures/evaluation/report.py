"""The report of an evaluation of textures: one HTML file."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from palpate.analysis.reports.figures import DrawnFigure, figure_block
from palpate.analysis.reports.figures import chosen as pictures
from palpate.analysis.reports.page import EVALUATION, Block, Column, Heading, Page, Section, Words, page_html, table
from palpate.analysis.reports.tables import in_seconds
from palpate.modeling.evaluate.outputs import Choice, software_table
from palpate.modeling.textures.evaluation import words
from palpate.modeling.textures.evaluation.evaluate import RULE, TextureEvaluation, choice
from palpate.modeling.textures.evaluation.tables import (
    Row,
    free_rows,
    grid_rows,
    method_rows,
    table_4_1,
    table_4_2,
    table_4_3,
    texture_rows,
)
from palpate.modeling.textures.evaluation.targets import reached
from palpate.modeling.textures.free_run import LIMITS
from palpate.modeling.textures.recording import recording_digest
from palpate.modeling.textures.registry import METHODS

OVERALL = (
    Column("title", "method"),
    Column("limits", "limits kept", "text", "On how many textures all limits of running free are met"),
    Column("felt_dB", "felt off, dB", "2", "Mean over the textures", "low"),
    Column("level_range", "level", "text", "Least and greatest of the textures; the truth is 1"),
    Column("smoothed_gfc", "smoothed GFC", "3", "The worst texture", "high"),
    Column("envelope", "envelope", "3", "Correlation with the truth's; the worst texture", "high"),
    Column("cycle_excess", "repeats", "2", "Autocorrelation beyond 300 ms above the truth's; the worst", "low"),
    Column("mae", "one step, MAE", "3", "SDs; mean over the textures", "low"),
    Column("step_us", "step, µs", "1", "Median in the fastest runtime here", "low"),
    Column("train_s", "training", "s", "Mean over the textures", "low"),
)
FREE = (
    Column("title", "method"),
    Column("level", "level", "3", "RMS over the truth's"),
    Column("smoothed_gfc", "smoothed GFC", "3"),
    Column("raw_gfc", "raw GFC, 1 s", "3", "Equation 4.11 over blocks of 1 s"),
    Column("envelope", "envelope", "3", "Correlation with the truth's envelope"),
    Column("with_speed", "with speed", "2", "Correlation of the envelope with the hand's speed"),
    Column("with_force", "with force", "2", "Correlation of the envelope with the force"),
    Column("cycle", "repeats", "2", "Greatest autocorrelation at 0.3 to 1 s"),
    Column("felt_dB", "felt off, dB", "2"),
    Column("greatest", "greatest", "2", "Greatest sample over the truth's"),
    Column("limits", "beyond", "words", "The limits that are not met"),
)
TIMES = (
    Column("title", "method"),
    Column("window", "window", "int"),
    Column("runtime", "runtime"),
    Column("median_us", "step, µs", "1"),
    Column("p99_us", "99 %, µs", "1"),
    Column("error", "error", "tiny", "Against the float64 reference, in SDs of the answers"),
    Column("felt_dB", "felt off, dB", "2", "Running free; mean over the textures"),
    Column("mae", "one step, MAE", "3", "SDs; mean over the textures"),
    Column("epoch_s", "an epoch, s", "2"),
    Column("train_s", "training", "s"),
    Column("thesis_cpu_ms", "thesis: CPU, ms", "2"),
    Column("thesis_gpu_ms", "GPU, ms", "2"),
    Column("thesis_epoch_s", "an epoch, s", "2"),
)
ONE_STEP = (("mae", "Table 4.1, MAE", "3", "low"), ("gfc", "Table 4.1, GFC, %", "2", "high"))
VARIANTS = (
    Column("title", "features"),
    Column("window", "window", "int"),
    Column("mae", "MAE", "3", "SDs", "low"),
    Column("gfc", "GFC, %", "2", "", "high"),
    Column("thesis_window", "thesis: window", "int"),
    Column("thesis_mae", "MAE", "3"),
    Column("thesis_gfc", "GFC, %", "2"),
)
CHOSEN = (
    Column("title", "features"),
    Column("window", "window", "int"),
    Column("loss", "loss"),
    Column("mae", "MAE of the test part", "3", "SDs", "low"),
    Column("gfc", "GFC, %", "2", "", "high"),
    Column("textures", "textures", "int"),
)
THEIRS = ("thesis_window", "thesis_mae", "thesis_gfc", "thesis_cpu_ms", "thesis_gpu_ms", "thesis_epoch_s")
SHORT = {"level": "level", "smoothed_gfc": "GFC", "envelope": "envelope", "cycle_excess": "repeats", "greatest": "size"}


def report_html(evaluation: TextureEvaluation, pictured: Sequence[DrawnFigure] = ()) -> str:
    """Return the whole page as HTML, with all names escaped."""
    chosen = choice_of(evaluation)
    points = [*(("Ours", sentence) for sentence in chosen.of_ours), *reached(evaluation)]
    sections = (
        chosen.section(RULE, points), free_section(evaluation, pictured, chosen),
        step_section(evaluation, pictured, chosen), time_section(evaluation, pictured, chosen), provenance(evaluation),
    )  # fmt: skip
    return page_html(Page(words.TITLE, words.LEAD, banners(evaluation), facts(evaluation), sections), EVALUATION)


def choice_of(evaluation: TextureEvaluation) -> Choice:
    """Return the default method and the reason."""
    return choice(method_rows(evaluation), texture_rows(evaluation))


def banners(evaluation: TextureEvaluation) -> list[str]:
    """Return the warnings at the head of the page."""
    lines = [words.SIMULATED] if evaluation.options.explore else []
    lines += [words.QUICK] if evaluation.options.quick else []
    labels = {name: recording.label for name, recording in evaluation.domain.recordings.items()}
    seen = [labels[name] for name, drive in evaluation.drives.items() if drive.seen]
    lines += [words.SEEN.format(textures=", ".join(seen))] if seen else []
    lines += [f"Left out: {why}" for why in evaluation.domain.left_out.values()]
    return lines


def facts(evaluation: TextureEvaluation) -> list[tuple[str, str]]:
    """Return the facts at the head of the page, each with its name."""
    recordings = evaluation.domain.recordings.values()
    seconds = sorted({round(recording.seconds, 1) for recording in recordings})
    long = f"{seconds[0]:g} s" if len(seconds) == 1 else f"{seconds[0]:g} to {seconds[-1]:g} s"
    whole = hashlib.sha256("".join(map(recording_digest, recordings)).encode()).hexdigest()
    return [
        ("Textures", f"{len(evaluation.textures)}"),
        ("Recorded of each", long),
        ("Methods", f"{len(evaluation.options.names)}"),
        ("Running free", f"{evaluation.domain.seconds:g} s" if evaluation.drives else "not possible"),
        ("Data, SHA-256", whole[:12]),
    ]


def free_section(evaluation: TextureEvaluation, pictured: Sequence[DrawnFigure], chosen: Choice) -> Section:
    """Return the section of free runs, in which a model runs on its own output."""
    rows = method_rows(evaluation)
    for row in rows:
        low, high = row["level_low"], row["level_high"]
        row["limits"] = f"{row['kept']} of {row['ran']}" if row["ran"] else None
        row["level_range"] = None if low is None else f"{low:.2f} to {high:.2f}"
    blocks: list[Block] = [Words(text) for text in _free_run_words(evaluation)]
    note = f"{words.WORST} {'; '.join(LIMITS.values())[:1].upper()}{'; '.join(LIMITS.values())[1:]}."
    blocks.append(table("All methods", rows, OVERALL, note=note, ours=chosen.method))
    blocks.append(Words(words.MEASURES, "note"))
    blocks += [figure_block(figure) for figure in pictures(pictured, "free_waves", "free_spectra", "free_envelopes")]
    free = free_rows(evaluation)
    for texture in evaluation.drives:
        own = [
            {**row, "limits": ", ".join(SHORT[name] for name in row["beyond"].split()) or None}
            for row in free
            if row["texture"] == texture
        ]
        blocks.append(table(evaluation.domain.recordings[texture].label, own, FREE, folded=True, ours=chosen.method))
    refused = [row for row in texture_rows(evaluation) if row["refused"]]
    if refused:
        columns = [Column("texture", "texture"), Column("title", "method"), Column("refused", "why", "words")]
        blocks.append(table("Not evaluated", refused, columns))
    return Section("free", "Running free", tuple(blocks))


def _free_run_words(evaluation: TextureEvaluation) -> list[str]:
    """Return sentences about the hand that drove the models, and about the best possible result."""
    if not evaluation.drives:
        return ["Nothing could be run free; the reasons are given below the recordings at the end."]
    origins = dict.fromkeys(drive.origin for drive in evaluation.drives.values())
    sentences = [
        words.FREE.format(origin=words.ORIGINS[origin], seconds=evaluation.domain.seconds) for origin in origins
    ]
    if all(drive.same_hand for drive in evaluation.drives.values()):
        return [*sentences, words.SAME_HAND]
    whats = {words.HALVES if drive.seen else words.VALIDATION for drive in evaluation.drives.values()}
    return [*sentences, words.OTHER_HAND.format(what=" or ".join(sorted(whats)))]


def step_section(evaluation: TextureEvaluation, pictured: Sequence[DrawnFigure], chosen: Choice) -> Section:
    """Return the section of errors one step ahead: Tables 4.1 and 4.2, Figures 4.5 to 4.7."""
    blocks: list[Block] = [Words(words.ONE_STEP), Words(words.BLIND)]
    generators = [
        evaluation.method(name).title for name in evaluation.options.names if evaluation.method(name).kind == "block"
    ]
    blocks += [Words(words.BLOCKS.format(titles=", ".join(generators)), "note")] if generators else []
    titles = {name: recording.label for name, recording in evaluation.domain.recordings.items()}
    rows = table_4_1(evaluation)
    for metric, title, form, better in (
        ("mae", "Table 4.1, MAE", "3", "low"),
        ("gfc", "Table 4.1, GFC, %", "2", "high"),
    ):
        cells = [Column(name, label, form, "", better) for name, label in (*titles.items(), ("mean", "mean"))]
        own = [row for row in rows if row["metric"] == metric]
        blocks.append(table(title, own, [Column("title", "method"), *cells], note=words.PRIVATE, ours=chosen.method))
    if variants := table_4_2(evaluation):
        blocks.append(table("Table 4.2, spectral features", variants, VARIANTS, ours=chosen.method, theirs=THEIRS))
    if compared := [row for row in grid_rows(evaluation) if row["chosen"]]:
        titles_of = [{**row, "title": METHODS[row["method"]].title} for row in compared]
        blocks.append(table("Table 4.2, window and loss chosen by the validation part", titles_of, CHOSEN))
    blocks += [
        figure_block(figure, "Figure " + figure.name.removeprefix("figure_").removesuffix("_free").replace("_", "."))
        for figure in pictures(pictured, "figure_4_")
    ]
    if not pictures(pictured, "figure_4_5"):
        blocks.append(Words(words.NO_GRID, "note"))
    return Section("step", "One step ahead", tuple(blocks))


def time_section(evaluation: TextureEvaluation, pictured: Sequence[DrawnFigure], chosen: Choice) -> Section:
    """Return the section of Table 4.3, and of error against time."""
    blocks: list[Block] = [Words(words.TIMES)]
    blocks.append(
        table("Table 4.3, time", table_4_3(evaluation), TIMES, note=words.PRIVATE, ours=chosen.method, theirs=THEIRS)
    )
    blocks += [figure_block(figure) for figure in pictures(pictured, "work_precision", "learning_")]
    return Section("time", "Time", tuple(blocks))


def _job_counts(evaluation: TextureEvaluation) -> str:
    """Return a sentence with the number of jobs, and of those computed now."""
    jobs, loaded = len(evaluation.results), evaluation.results.loaded
    if loaded == jobs:
        return f"{jobs} jobs, all of them taken from earlier, equal evaluations."
    earlier = f", {loaded} of them taken from earlier, equal evaluations" if loaded else ""
    return f"{jobs} jobs{earlier}; the {'rest' if loaded else 'whole'} took {in_seconds(evaluation.seconds)} here."


def provenance(evaluation: TextureEvaluation) -> Section:
    """Return the section that names the inputs, the run and the software."""
    run = f"Seed {evaluation.options.seed}. {_job_counts(evaluation)}"
    inputs: list[Row] = [
        {"input": line} for recording in evaluation.domain.recordings.values() for line in recording.made_from
    ]
    blocks: list[Block] = [Words(run), Words(words.UNROUNDED), Heading("Recordings")]
    rows: list[Row] = [
        {"texture": evaluation.domain.recordings[name].label, "seconds": evaluation.domain.recordings[name].seconds,
         "notes": "; ".join(notes) or None}
        for name, notes in evaluation.notes.items()
    ]  # fmt: skip
    columns = [Column("texture", "texture"), Column("seconds", "seconds", "1"), Column("notes", "notes", "words")]
    blocks.append(table("What was done to them", rows, columns))
    blocks.append(
        table("Inputs and their SHA-256", inputs, [Column("input", "input", "words")], folded=len(inputs) > 6)
    )
    sources = [Column("title", "method"), Column("method", "name"), Column("source", "source", "words")]
    blocks.append(table("Methods and their sources", method_rows(evaluation), sources))
    blocks.append(software_table())
    return Section("provenance", "Provenance", tuple(blocks))
