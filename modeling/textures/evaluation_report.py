"""The report of an evaluation of textures: one HTML file."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from palpate.analysis.reports.figures import DrawnFigure
from palpate.analysis.reports.page import EVALUATION, Page, page_html
from palpate.modeling.evaluate.outputs import Choice
from palpate.modeling.textures import evaluation_words as words
from palpate.modeling.textures.choice import RULE, choice
from palpate.modeling.textures.evaluation import TextureEvaluation
from palpate.modeling.textures.evaluation_reached import reached
from palpate.modeling.textures.evaluation_sections import free_section, provenance, step_section, time_section
from palpate.modeling.textures.evaluation_tables import method_rows, texture_rows
from palpate.modeling.textures.recording import recording_digest


def report_html(evaluation: TextureEvaluation, pictured: Sequence[DrawnFigure] = ()) -> str:
    """The whole page as one text. Every name in it is escaped."""
    chosen = choice_of(evaluation)
    points = [*(("Ours", sentence) for sentence in chosen.of_ours), *reached(evaluation)]
    sections = (
        chosen.section(RULE, points), free_section(evaluation, pictured, chosen),
        step_section(evaluation, pictured, chosen), time_section(evaluation, pictured, chosen), provenance(evaluation),
    )  # fmt: skip
    return page_html(Page(words.TITLE, words.LEAD, banners(evaluation), facts(evaluation), sections), EVALUATION)


def choice_of(evaluation: TextureEvaluation) -> Choice:
    """The default method and why."""
    return choice(method_rows(evaluation), texture_rows(evaluation))


def banners(evaluation: TextureEvaluation) -> list[str]:
    """What has to be known before any number is read."""
    told = [words.SIMULATED] if evaluation.options.explore else []
    told += [words.QUICK] if evaluation.options.quick else []
    labels = {name: each.label for name, each in evaluation.domain.recordings.items()}
    seen = [labels[name] for name, drive in evaluation.drives.items() if drive.seen]
    told += [words.SEEN.format(textures=", ".join(seen))] if seen else []
    told += [f"Left out: {why}" for why in evaluation.domain.left_out.values()]
    return told


def facts(evaluation: TextureEvaluation) -> list[tuple[str, str]]:
    """What stands at the head of the page."""
    recordings = evaluation.domain.recordings.values()
    seconds = sorted({round(each.seconds, 1) for each in recordings})
    long = f"{seconds[0]:g} s" if len(seconds) == 1 else f"{seconds[0]:g} to {seconds[-1]:g} s"
    whole = hashlib.sha256("".join(map(recording_digest, recordings)).encode()).hexdigest()
    return [
        ("Textures", f"{len(evaluation.textures)}"),
        ("Recorded of each", long),
        ("Methods", f"{len(evaluation.options.names)}"),
        ("Running free", f"{evaluation.domain.seconds:g} s" if evaluation.drives else "not possible"),
        ("Data, SHA-256", whole[:12]),
    ]
