"""Everything that a regenerated study is written to: tables, statistics, figures, documents and the report."""

from __future__ import annotations

from pathlib import Path

from palpate.analysis.crosschecking.checks import FILE as CROSSCHECK
from palpate.analysis.crosschecking.checks import crosscheck_json
from palpate.analysis.regenerating.documents import titled_tables
from palpate.analysis.regenerating.files import file_texts
from palpate.analysis.regenerating.latex_tables import latex_text
from palpate.analysis.regenerating.page import report_html
from palpate.analysis.regenerating.pictured import draw_all
from palpate.analysis.regenerating.placing import written_whole
from palpate.analysis.regenerating.regenerated import Regenerated
from palpate.analysis.regenerating.seconds import FILE, remembered
from palpate.analysis.regenerating.word_tables import word_bytes
from palpate.protocols.files import write_bytes, write_text, write_texts
from palpate.protocols.progress import Progress

FOLDER = "regenerated"
"""Where a lab keeps what was regenerated."""
SIMULATED = "Simulated participants: no person gave these answers."


def times_of(found: Regenerated, lab: Path) -> dict[int, float]:
    """How long each answer took when it was first computed in this lab."""
    return remembered(found, lab / FOLDER / FILE)


def write_all(
    found: Regenerated, folder: Path, seconds: dict[int, float], figures: bool, progress: Progress = lambda *_: None
) -> list[Path]:
    """Write every output to `folder` and give the paths: equal inputs give equal bytes.

    Without `figures` neither pictures nor the report are made. What an earlier run made and this one does not is
    removed; nothing else in the folder is touched. Raises PlaceRefused where another's file is in the way.
    """
    with written_whole(folder) as (draft, names):
        # The pictures first: of all that is written they take the most memory.
        pictures = list(draw_all(found.pictured, draft / "figures", progress)) if figures else []
        write_texts(draft, file_texts(found, seconds))
        if found.checks is not None:
            write_texts(draft, {CROSSCHECK: crosscheck_json(found.checks)})
        write_documents(found, draft)
        if figures:
            page = report_html(found, pictures, sum(seconds.values()))
            write_text(draft / "report.html", page)
    return [folder / name for name in names]


def write_documents(found: Regenerated, folder: Path) -> list[Path]:
    """Write tables.docx and tables.tex."""
    simulated = SIMULATED if found.material.simulated else ""
    tables = list(titled_tables(found))
    word, latex = folder / "tables.docx", folder / "tables.tex"
    write_bytes(word, word_bytes(found.title, simulated, tables))
    write_text(latex, latex_text(found.title, simulated, tables))
    return [word, latex]
