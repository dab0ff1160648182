"""The texts of all screens by key, in a language: English and Korean are shipped, a lab can add its own file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from string import Formatter
from typing import Any

from palpate.devices.window.geometry import WindowError
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.yaml_text import YamlError, load

SHIPPED = Path(__file__).resolve().parent / "texts"
MASTER = "en"
"""The language whose keys and placeholders every other language must have."""


@dataclass(frozen=True)
class Texts:
    """The texts of the screens in one language."""

    language: str
    words: Mapping[str, str]

    def __call__(self, key: str, **values: Any) -> str:
        """Return the text of a key with its placeholders filled in. Raises KeyError for an unknown key."""
        return self.words[key].format(**values) if values else self.words[key]


def languages() -> tuple[str, ...]:
    """Return the shipped languages."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.yaml")))


def load_texts(language: str = MASTER, extra: Path | None = None) -> Texts:
    """Return the screens' texts in a shipped language, or from a lab's own file.

    Raises WindowError that lists all problems.
    """
    file = extra or SHIPPED / f"{language}.yaml"
    if not file.is_file():
        known = nearest(language, languages())
        raise WindowError(
            f"no texts in language {language!r}; {known}; {file} is missing: for a language of your own translate a "
            f"copy of {SHIPPED / 'en.yaml'} as LAB/texts/{language}.yaml"
        )
    if faults := problems(file):
        raise WindowError("\n".join(faults))
    return Texts(language, read_words(file))


def window_texts(folder: Path, whose: str, language: str = MASTER) -> Texts:
    """Return a window's own texts from a folder, with those of the shared pages. Raises WindowError."""
    file = folder / f"{language}.yaml"
    if not file.is_file():
        known = nearest(language, sorted(path.stem for path in folder.glob("*.yaml")))
        raise WindowError(f"the {whose}'s window has no texts in language {language!r}; {known}")
    return Texts(language, {**load_texts(language).words, **read_words(file)})


def problems(file: Path) -> list[str]:
    """Return the problems of a language file, compared with the English one, for `palpate check`."""
    try:
        words = read_words(file)
    except WindowError as error:
        return [str(error)]
    return list(_against(file, words, read_words(SHIPPED / f"{MASTER}.yaml")))


def read_words(file: Path) -> dict[str, str]:
    """Return a flat YAML mapping of texts. Raises WindowError."""
    try:
        document = load(file.read_bytes(), str(file))
    except YamlError as error:
        raise WindowError(str(error)) from None
    if not isinstance(document.data, dict):
        raise WindowError(f"{file}: key: text on every line is expected")
    for key, value in document.data.items():
        if not isinstance(value, str) or not value.strip():
            line = document.lines.get((key,), 1)
            raise WindowError(f"{file}: line {line}: {key}: a text is expected, found {value!r}")
    return {str(key): value.strip() for key, value in document.data.items()}


def placeholders(text: str) -> set[str]:
    """Return the names in braces. Raises ValueError for unbalanced braces."""
    return {name for _, name, _, _ in Formatter().parse(text) if name is not None}


def _against(file: Path, words: Mapping[str, str], master: Mapping[str, str]) -> Iterator[str]:
    for key in master:
        if key not in words:
            yield f"{file}: the key {key!r} is missing; in English it says {master[key]!r:.80}"
    for key, text in words.items():
        if key not in master:
            yield f"{file}: unknown key {key!r}; {nearest(key, master)}"
        elif fault := _placeholder_fault(text, master[key]):
            yield f"{file}: {key}: {fault}"


def _placeholder_fault(text: str, master: str) -> str | None:
    expected = placeholders(master)
    try:
        present = placeholders(text)
    except ValueError as error:
        return f"{text!r:.80}: {error}; write {{{{ and }}}} for braces"
    if present == expected:
        return None
    shown = ", ".join(f"{{{name}}}" for name in sorted(expected)) or "none"
    return f"the placeholders {shown} are expected, found {', '.join(f'{{{n}}}' for n in sorted(present)) or 'none'}"
