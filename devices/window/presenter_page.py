"""The common page of every screen of a session, prepared and checked before any window is opened."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from palpate.devices.window.build import demand_shown
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.fonts import find_fonts
from palpate.devices.window.hangul import needed
from palpate.devices.window.screen import SLIDER_MM, Page
from palpate.devices.window.texts import load_texts
from palpate.devices.window.texts_study import load_study_texts, pages_of, study_texts
from palpate.protocols.canonical import digest
from palpate.protocols.extras import installed_version
from palpate.protocols.forms import Form
from palpate.protocols.plan import Plan
from palpate.protocols.study import Study


def prepare(
    study: Study, calibration: Calibration, language: str, folder: Path,
    pages: Mapping[str, str] | None = None, plan: Plan | None = None, texts_file: Path | None = None,
) -> Page:  # fmt: skip
    """Return the page with the texts in the language and fonts for them, after checking that all forms fit.

    Raises WindowError that names the text, the characters or the form that cannot be shown.
    """
    texts, words = load_texts(language, texts_file), load_study_texts(study, folder, language)
    fonts = find_fonts(language)
    page = Page(
        calibration.metrics, texts, fonts, words, pages_of(study) | dict(pages or {}), title=study.title or study.study,
        total=0 if plan is None else len(plan.trials),
        length_mm=SLIDER_MM if study.scale is None else study.scale.length_mm,
        hangul=needed(language, sys.platform), may_rest=study.rest is not None and study.rest.button,
    )  # fmt: skip
    fonts.demand([*texts.words.values(), *map(page.say, study_texts(study)), *map(page.say, page.pages.values())])
    if plan is not None:
        demand_shown(_forms(plan), page)
    return page


def describe(page: Page) -> dict[str, Any]:
    """Return the window's size, density, language and a digest of every readable text, for the ledger."""
    texts = {"screens": dict(page.texts.words), "study": dict(page.words), "pages": dict(page.pages)}
    return {
        "size_px": [page.metrics.width_px, page.metrics.height_px],
        "px_per_mm": page.metrics.px_per_mm,
        "language": page.texts.language,
        "texts": digest(texts),
        "backend": "psychopy, pyglet",
        "psychopy": installed_version("psychopy"),
    }


def _forms(plan: Plan) -> Iterator[Form]:
    yield from plan.opening
    yield from _different(trial.form for trial in plan.trials)
    yield from (anchor.form for anchor in plan.anchors.get(0, ()) if anchor.form is not None)
    yield from plan.closing


def _different(forms: Iterable[Form | None]) -> Iterator[Form]:
    """Yield each form once; forms of one name that are equal are shown alike."""
    seen: list[Form] = []
    for form in forms:
        if form is not None and not any(form is one or form == one for one in seen):
            seen.append(form)
            yield form
