"""The translation of a study's own texts: STUDY/texts/LANGUAGE.yaml maps each source text to its translation.

Long texts can be named instead of repeated: the keys `title`, `instructions` and `block LEVEL` (the instructions before
a block) stand for those texts. Names in the ledger stay as in the study file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from palpate.devices.window.geometry import WindowError
from palpate.devices.window.texts import MASTER, read_words
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.plan import block_page
from palpate.protocols.study import Study

INSTRUCTIONS = "instructions"


def pages_of(study: Study) -> dict[str, str]:
    """Return the study's own pages by their names: the instructions, and those before blocks."""
    blocks = study.order.blocks
    before = {} if blocks is None else {block_page(level): text for level, text in blocks.instructions.items()}
    return ({} if study.instructions is None else {INSTRUCTIONS: study.instructions}) | before


def study_texts(study: Study) -> tuple[str, ...]:
    """Return every text of the study that a participant may read, each once, in the order of the file."""
    texts = [study.title, *pages_of(study).values(), *study.sides]
    for attribute in study.attributes:
        texts += [attribute.low, attribute.high, attribute.explanation]
    if study.scale is not None:
        texts += [text for _, text in study.scale.labels]
    texts += [question.text for question in study.interview]
    texts += [criterion.text for criterion in study.eligible]
    texts += [anchor.label for anchor in study.anchors.stimuli] if study.anchors is not None else []
    texts += [text for question in study.ask for text in _texts_of(question)]
    texts += study.intervals.names if study.intervals is not None else ()
    if study.adjectives is not None:
        texts += [word.word for word in study.adjectives.words]
    if study.questionnaire is not None:
        texts += [*(item.text for item in study.questionnaire.items), *study.questionnaire.ends]
    return tuple(dict.fromkeys(text for text in texts if text))


def _texts_of(question: Any) -> Iterator[str | None]:
    """Yield what a question of `ask:` says: its text, its options, its ends, its unit, and the labels of its scale."""
    yield question.text
    yield from getattr(question, "options", ())
    yield from getattr(question, "ends", None) or ()
    yield getattr(question, "unit", None)
    scale = getattr(question, "scale", None)
    yield from (label for _, label in (() if scale is None else scale.labels))


def load_study_texts(study: Study, folder: Path, language: str) -> dict[str, str]:
    """Return {source text: translation}, with single spaces in the source; {} for the study as written.

    A study is assumed to be written in English. Raises WindowError for a missing file and for every problem in it.
    """
    file = folder / "texts" / f"{language}.yaml"
    if language == MASTER and not file.is_file():
        return {}
    if not file.is_file():
        raise WindowError(f"{file}: missing; the study's texts in language {language!r} are expected there")
    if faults := study_problems(study, file):
        raise WindowError("\n".join(faults))
    return _by_source(study, read_words(file))


def check_study_texts(study: Study, folder: Path) -> list[str]:
    """Return the problems of the translations beside a study, for `palpate check`."""
    files = sorted((folder / "texts").glob("*.yaml"))
    return [fault for file in files for fault in study_problems(study, file)]


def study_problems(study: Study, file: Path) -> list[str]:
    """Return the problems of one translation of a study."""
    try:
        words = read_words(file)
    except WindowError as error:
        return [str(error)]
    return list(_faults(study, file, words))


def plain(text: str) -> str:
    """Return a text with single spaces, the form in which translations are looked up."""
    return " ".join(text.split())


def _faults(study: Study, file: Path, words: Mapping[str, str]) -> Iterator[str]:
    sources = {plain(text): text for text in study_texts(study)}
    translated = _by_source(study, words)
    for source in sources:
        if source not in translated:
            yield f"{file}: no translation of {source!r:.90}"
    for key in words:
        if plain(key) not in sources and key not in _named(study):
            yield f"{file}: {key!r:.90} is not a text of the study; {nearest(plain(key), sources)}"


def _by_source(study: Study, words: Mapping[str, str]) -> dict[str, str]:
    sources = {plain(text) for text in study_texts(study)}
    named = _named(study)
    translations = {}
    for key, translation in words.items():
        source = named.get(key) if plain(key) not in sources else key
        if source is not None:
            translations[plain(source)] = translation
    return translations


def _named(study: Study) -> dict[str, str | None]:
    """Return the texts that a translation may name instead of repeating them."""
    return {"title": study.title, INSTRUCTIONS: study.instructions, **pages_of(study)}
