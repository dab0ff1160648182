"""Everything that a regenerated study is written to: tables, statistics, figures, documents and the report."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from analysis.regenerating.documents import write_documents
from analysis.regenerating.files import file_texts
from analysis.regenerating.page import report_html
from analysis.regenerating.pictured import draw_all
from analysis.regenerating.regenerated import Regenerated
from analysis.regenerating.seconds import FILE, remembered
from analysis.reporting.csv_files import write_texts

Progress = Callable[[int, int, str], None]
FOLDER = "regenerated"
"""Where a lab keeps what was regenerated."""
OWN = ("tables", "tests", "figures")
"""Folders that hold nothing but what is made here: a test that left the plan leaves no table behind."""


def times_of(found: Regenerated, lab: Path) -> dict[int, float]:
    """How long each answer took when it was first computed in this lab."""
    return remembered(found.answered, found.software, lab / FOLDER / FILE)


def write_all(
    found: Regenerated, folder: Path, seconds: dict[int, float], figures: bool, progress: Progress = lambda *_: None
) -> list[Path]:
    """Write every output to `folder` and give the paths: equal inputs give equal bytes.

    Without `figures` neither pictures nor the report are made.
    """
    for name in OWN:
        shutil.rmtree(folder / name, ignore_errors=True)
    paths = write_texts(file_texts(found, seconds), folder)
    paths += write_documents(found, folder)
    if figures:
        pictures = list(draw_all(found.pictured, folder / "figures", progress))
        paths += [file for picture in pictures if picture is not None for file in picture.files]
        page = folder / "report.html"
        page.write_text(report_html(found, pictures, sum(seconds.values())), encoding="utf-8", newline="\n")
        paths.append(page)
    return paths
