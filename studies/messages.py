"""Errors in a user's words: the only place that turns system, database and parser errors into messages."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import sqlite3
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

from protocols.files import reason

ROOMS = ("protocols", "devices", "studies", "analysis", "modeling")
DATABASES = "a SQLite file (sqlite:///lab.sqlite) or PostgreSQL (postgresql+psycopg://user@host/lab)"
_SECRETS = "password|passwd|pwd|secret|token|sslpassword|passfile"


def describe_error(error: BaseException) -> str | None:
    """Return what went wrong and where, or None for a fault of the program, which needs its traceback."""
    text = _describe(error)
    if text is None:
        return None
    return hide_passwords("; ".join([text.strip(), *getattr(error, "__notes__", [])]))


def hide_passwords(text: str) -> str:
    """Return the text with `***` for every password in a URL, also in one that no program could read."""
    text = re.sub(rf"(?i)\b({_SECRETS})(\s*=\s*)([^\s&;,'\"]+)", r"\1\2***", text)
    text = re.sub(r"(\w[\w+.-]*:/{1,3})?([^\s/:@'\"]+):([^\s'\"]+)@", _hide_in_url, text)
    return text


def database_reason(error: BaseException) -> str:
    """Return what a database or its driver reports, on one line and without passwords."""
    said = str(getattr(error, "orig", None) or error).strip() or type(error).__name__
    return hide_passwords(" ".join(said.split("\n(Background on this error")[0].split()))


def _hide_in_url(match: re.Match[str]) -> str:
    return f"{match[1] or ''}{match[2]}:***@"


def _describe(error: BaseException) -> str | None:
    if type(error).__module__.partition(".")[0] in ROOMS:
        return str(error)
    if isinstance(error, OSError) and error.errno is not None:
        where = error.filename if isinstance(error.filename, str | os.PathLike) else _place(error.__traceback__)
        return f"{where}: {reason(error)}" if where else reason(error)
    if isinstance(error, MemoryError):
        return "the machine has not enough memory for this; close other programs, or give less data at once"
    kind = _kind(error)
    return None if kind is None else f"{_place(error.__traceback__) or kind[0]}: {kind[1]}"


def _kind(error: BaseException) -> tuple[str, str] | None:
    """Return what could not be used and why, for errors of databases and parsers."""
    if isinstance(error, sqlite3.Error | _imported("sqlalchemy.exc", "SQLAlchemyError", "psycopg", "Error")):
        return "the database", database_reason(error)
    if isinstance(error, _imported("yaml", "YAMLError")):
        return "a YAML file", f"not valid YAML: {' '.join(str(error).split())}"
    if isinstance(error, json.JSONDecodeError):
        return "a JSON file", f"not valid JSON: {error}"
    if isinstance(error, UnicodeDecodeError):
        return "a text file", f"byte {error.start} is not UTF-8; save the file as UTF-8"
    if isinstance(error, csv.Error):
        return "a table", f"not a table of comma-separated values: {error}"
    if isinstance(error, zipfile.BadZipFile | EOFError) or type(error).__name__ == "BadGzipFile":
        return "a compressed file", f"damaged or cut short: {error}"
    return None


def _imported(*pairs: str) -> tuple[type[BaseException], ...]:
    """Return the named classes of the modules that this process has imported; another cannot have raised."""
    modules = [(sys.modules.get(name), kind) for name, kind in zip(pairs[::2], pairs[1::2], strict=True)]
    return tuple(getattr(module, kind) for module, kind in modules if module is not None)


def _place(traceback: TracebackType | None) -> str | None:
    """Return the file or database that the innermost frame of an error had open: read() and parsers name none."""
    frames = []
    while traceback is not None:
        frames.append(traceback.tb_frame)
        traceback = traceback.tb_next
    return next((place for frame in reversed(frames) for place in _places(frame.f_locals)), None)


def _places(variables: dict[str, Any]) -> Iterator[str]:
    for name, value in variables.items():
        if isinstance(value, io.IOBase) and isinstance(opened := getattr(value, "name", None), str):
            yield opened
        elif isinstance(value, Path) and name in {"self", "path", "file"}:
            yield str(value)
        elif hasattr(value, "render_as_string"):
            yield value.render_as_string(hide_password=True)
