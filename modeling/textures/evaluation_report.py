"""The report of an evaluation of textures: one HTML file."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from palpate.analysis.reports.blocks import Block, Points, Section
from palpate.analysis.reports.figures import DrawnFigure
from palpate.analysis.reports.page import EVALUATION, Page, page_html
from palpate.modeling.textures import evaluation_words as words
from palpate.modeling.textures.evaluation_reached import reached
from palpate.modeling.textures.evaluation_sections import free_section, provenance, step_section, time_section
from palpate.modeling.textures.evaluation_tables import method_rows, texture_rows
from palpate.modeling.textures.judging_default import RULE, Choice, choice
from palpate.modeling.textures.judging_kept import recording_digest
from palpate.modeling.textures.judging_whole import Judged


def report_html(found: Judged, pictured: Sequence[DrawnFigure] = ()) -> str:
    """The whole page as one text. Every name in it is escaped."""
    chosen = choice_of(found)
    sections = (
        in_short(found, chosen), free_section(found, pictured, chosen), step_section(found, pictured, chosen),
        time_section(found, pictured, chosen), provenance(found),
    )  # fmt: skip
    return page_html(Page(words.TITLE, words.LEAD, banners(found), facts(found), sections), EVALUATION)


def choice_of(found: Judged) -> Choice:
    """The default method and why."""
    return choice(method_rows(found), texture_rows(found))


def banners(found: Judged) -> list[str]:
    """What has to be known before any number is read."""
    told = [words.SIMULATED] if found.wanted.explore else []
    told += [words.QUICK] if found.wanted.quick else []
    labels = {name: each.label for name, each in found.context.recordings.items()}
    seen = [labels[name] for name, drive in found.drives.items() if drive.seen]
    told += [words.SEEN.format(textures=", ".join(seen))] if seen else []
    told += [f"Left out: {why}" for why in found.context.left_out.values()]
    return told


def facts(found: Judged) -> list[tuple[str, str]]:
    """What stands at the head of the page."""
    recordings = found.context.recordings.values()
    seconds = sorted({round(each.seconds, 1) for each in recordings})
    long = f"{seconds[0]:g} s" if len(seconds) == 1 else f"{seconds[0]:g} to {seconds[-1]:g} s"
    whole = hashlib.sha256("".join(map(recording_digest, recordings)).encode()).hexdigest()
    return [
        ("Textures", f"{len(found.textures)}"),
        ("Recorded of each", long),
        ("Methods", f"{len(found.wanted.names)}"),
        ("Running free", f"{found.context.seconds:g} s" if found.drives else "not possible"),
        ("Data, SHA-256", whole[:12]),
    ]


def in_short(found: Judged, chosen: Choice) -> Section:
    """The default method and why, and what was set out to be reached."""
    points = [("Default", f"{chosen.method}. {chosen.why}"), ("The rule", RULE)]
    points += [("Ours", text) for text in chosen.of_ours]
    points += reached(found)
    blocks: tuple[Block, ...] = (Points(tuple(points)),)
    return Section("short", "In short", blocks)
