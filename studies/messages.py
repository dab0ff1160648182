"""Errors in a user's words: the only module that turns system, database and parser errors into messages."""

from __future__ import annotations

import io
import os
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import unquote

from palpate.protocols.extras import EXTRAS, missing_sentence
from palpate.protocols.files import reason

DATABASES = (
    "a SQLite file, as sqlite:///lab.sqlite, or PostgreSQL, as postgresql+psycopg://user@host/lab (with its driver:"
    " pip install 'palpate[postgres]')"
)
_STREAMS = {"<stdout>": "the standard output", "<stdin>": "the standard input", "<stderr>": "the standard error"}
_PARSERS = {
    "YAML": ("yaml.YAMLError",),
    "JSON": ("json.JSONDecodeError",),
    "CSV": ("csv.Error",),
    "compressed": ("zipfile.BadZipFile", "gzip.BadGzipFile", "zlib.error", "builtins.EOFError"),
}
_SECRETS = (
    re.compile(
        r"(?i)(?P<name>\b\w*(?:password|passwd|pwd|secret|token)\s*=\s*['\"]?)(?P<secret>[^\s&;,'\"]+)(?P<end>)"
    ),
    re.compile(r"(?P<name>:)(?!//|\*\*\*@|(?<=\b[A-Za-z]:)[\\/])(?P<secret>[^\s'\"]+)(?P<end>@)"),
)
"""`password=SECRET`, and `:SECRET@` whatever precedes it."""


def describe_error(error: BaseException) -> str | None:
    """Describe what went wrong and where; return None for a fault of the program, which needs its traceback."""
    text = _describe(error)
    if text is None:
        return None
    return hide_passwords("; ".join([text.strip(), *getattr(error, "__notes__", [])]))


def hide_passwords(text: str, *urls: str) -> str:
    """Return the text with `***` for every password in a URL, also in a URL that no program can read.

    A driver may report a part of the URL that it was given: of the passwords in `urls` no part is left in the text.
    """
    for secret in (match["secret"] for url in urls for form in _SECRETS for match in form.finditer(url)):
        for part in (secret, *re.split(r"[@:/?#&]", secret), unquote(secret)):
            text = text.replace(part, "***") if len(part) > 1 else text
    for form in _SECRETS:
        text = form.sub(r"\g<name>***\g<end>", text)
    return text


def describe_url(url: Any) -> str:
    """Return a database's URL, given as text or as SQLAlchemy's URL, without its passwords."""
    whole = url if isinstance(url, str) else url.render_as_string(hide_password=False)
    return hide_passwords(whole)


def database_reason(error: BaseException, url: Any = "") -> str:
    """Return on one line, without passwords, why a database cannot be used or what its driver reports."""
    whole = url if isinstance(url, str) else url.render_as_string(hide_password=False)
    usual: tuple[tuple[tuple[type[BaseException], ...], str], ...] = (
        ((ModuleNotFoundError,), f"the driver {getattr(error, 'name', '')} is not installed; use {DATABASES}"),
        (_classes("sqlalchemy.exc.NoSuchModuleError"), f"this kind of database is unknown; use {DATABASES}"),
        ((ValueError, *_classes("sqlalchemy.exc.ArgumentError")), f"not a database URL; use {DATABASES}"),
        (_classes("sqlalchemy.exc.IntegrityError"), "another program wrote the same at this moment; try again"),
    )
    for kinds, message in usual:
        if isinstance(error, kinds):
            return message
    text = str(getattr(error, "orig", None) or error).strip() or type(error).__name__
    if "database is locked" in text:
        return "another program is writing into it; nothing was changed, try again"
    return hide_passwords(" ".join(text.split("\n(Background on this error")[0].split()), whole)


def _describe(error: BaseException) -> str | None:
    if type(error).__module__.startswith("palpate."):
        return str(error)
    if isinstance(error, OSError) and error.errno is not None:
        where = error.filename if isinstance(error.filename, str | os.PathLike) else _place(error.__traceback__)
        return f"{where}: {reason(error)}" if where else reason(error)
    if isinstance(error, shutil.Error) and error.args and isinstance(error.args[0], list):
        # The first file that `shutil.copytree` could not copy, and why: it keeps the reasons as texts.
        _, target, why = error.args[0][0]
        number = re.match(r"\[Errno (\d+)\]", why)
        return f"{target}: {reason(OSError(int(number[1]), why)) if number else why}"
    if isinstance(error, ModuleNotFoundError) and (name := (error.name or "").partition(".")[0]) in EXTRAS:
        return missing_sentence("this", [name])
    if isinstance(error, MemoryError):
        return "the machine has not enough memory for this; close other programs, or give less data at once"
    kind = _kind(error)
    return None if kind is None else f"{_place(error.__traceback__) or kind[0]}: {kind[1]}"


def _kind(error: BaseException) -> tuple[str, str] | None:
    """Return what could not be used and why, for errors of databases and parsers."""
    if isinstance(error, _classes("sqlite3.Error", "sqlalchemy.exc.SQLAlchemyError", "psycopg.Error")):
        return "the database", database_reason(error)
    if isinstance(error, UnicodeDecodeError):
        return "a text file", f"byte {error.start} is not UTF-8; save the file as UTF-8"
    for what, names in _PARSERS.items():
        if isinstance(error, _classes(*names)):
            return f"a {what} file", f"not valid {what}: {' '.join(str(error).split())}"
    return None


def _classes(*names: str) -> tuple[type[BaseException], ...]:
    """Return the named classes of the modules that this process has imported; another cannot have raised."""
    split = [name.rpartition(".") for name in names]
    return tuple(getattr(sys.modules[module], name) for module, _, name in split if module in sys.modules)


def _place(traceback: TracebackType | None) -> str | None:
    """Return the file or database that an error is about, from variables of its callers: parsers name none.

    The search goes from the innermost frame to the second one of Palpate: the outer ones hold other files, too.
    """
    frames, ours = [], 0
    while traceback is not None:
        frames.append(traceback.tb_frame)
        traceback = traceback.tb_next
    for frame in reversed(frames):
        for place in _places(frame.f_locals):
            return place
        ours += frame.f_globals.get("__name__", "").startswith("palpate.")
        if ours == 2:
            break
    return None


def _places(variables: dict[str, Any]) -> Iterator[str]:
    databases: Any = _classes("sqlalchemy.Engine", "sqlalchemy.Connection")
    for name, value in variables.items():
        if isinstance(value, io.IOBase) and isinstance(opened := getattr(value, "name", None), str):
            yield _STREAMS.get(opened, opened)
        elif isinstance(value, Path) and name in {"self", "path", "file"}:
            yield str(value)
        elif isinstance(value, databases):
            url = value.engine.url
            yield str(url.database) if url.drivername.startswith("sqlite") else describe_url(url)
