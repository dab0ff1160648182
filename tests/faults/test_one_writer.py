"""Product code writes files through `palpate.protocols.files` and nothing else; exceptions are listed with reasons."""

import ast
import re
from functools import cache
from pathlib import Path

from tests.names import PACKAGES

ROOT = Path(__file__).parents[2]
WRITER = "protocols/files.py"
METHODS = {
    "write_text": "Path.write_text", "write_bytes": "Path.write_bytes", "savefig": "a figure to a path",
    "savez": "arrays", "savez_compressed": "arrays", "savetxt": "arrays", "to_csv": "a table", "to_parquet": "a table",
    "to_excel": "a table", "save_file": "tensors", "rename": "a file", "replace": "a file", "symlink_to": "a link",
    "hardlink_to": "a link", "link": "a link", "copyfile": "a file", "copy": "a file", "copy2": "a file",
    "copytree": "a folder", "move": "a file", "mkstemp": "a file", "mkdtemp": "a folder", "touch": "a file",
}  # fmt: skip
"""Calls that write under a name of their own. `save` and `replace` are looked at more closely below."""
EXCEPTIONS = {
    "studies/sessions/ledger.py": "SQLite writes the ledger; its first event is linked or renamed into place by hand",
    "studies/participants/identities.py": "the journal of erased people is overwritten in place, to forget them",
    "studies/simulation/texture_set.py": "a shipped study is copied into a staged folder, placed as a whole",
    "devices/author/designs.py": "renames an earlier work aside, without writing",
    "devices/door/firmware/process.py": "a log of the emulator, appended line by line while it runs",
    "benchmarks/scale.py": "makes the temporary lab of a benchmark",
    "analysis/crosschecking/packages.py": "DataFrame.replace",
    "analysis/regenerating/regeneration.py": "to_csv gives text for a digest; no file",
    "analysis/plans/": "DataFrame.rename", "analysis/reliability/": "DataFrame.rename",
    "benchmarks/statistics/choices.py": "DataFrame.rename",
}  # fmt: skip

JSON_ELSEWHERE = {
    "protocols/canonical.py": "the two functions themselves",
    "analysis/monitoring/finished.py": "lines of a cache",
    "analysis/regenerating/outputs.py": "refuses NaN itself, and for a digest",
    "analysis/regenerating/comparison.py": "for people to compare",
    "benchmarks/streams/run.py": "to the process that asked", "devices/door/firmware/process.py": "to its parent",
    "benchmarks/doors/designer_window.py": "to its parent",
    "modeling/files/model_files.py": "a card that `canonical` has read",
    "modeling/attributes/model_file.py": "back to pydantic", "modeling/attributes/material.py": "for a digest",
}  # fmt: skip


CLOSER = {"open", "ZipFile", "TarFile", "save", "dump", "dumps"}
"""Further names whose calls are looked at."""
NAMED = re.compile(rf"\b(?:{'|'.join(sorted({*METHODS, *CLOSER}))})\s*\(")
"""Only a file that calls one of these is parsed: that takes most of the time."""


def calls(file):
    """(line, name, call) of every call of a method or function by its last name, where one of them is looked at."""
    text = file.read_text("utf-8")
    for node in ast.walk(ast.parse(text)) if NAMED.search(text) else ():
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            yield node.lineno, name, node


def opens_to_write(call):
    """Whether a call of any `open`, or of ZipFile, has a mode that writes."""
    texts = [
        node.value for node in (*call.args[:2], *(k.value for k in call.keywords)) if isinstance(node, ast.Constant)
    ]
    return any(isinstance(text, str) and set(text) <= set("rwaxbt+") and set(text) & set("wax+") for text in texts)


def writes(name, call):
    """Whether the call writes a file by itself."""
    method = isinstance(call.func, ast.Attribute)
    module = call.func.value.id if method and isinstance(call.func.value, ast.Name) else ""
    match name:
        case "open" | "ZipFile" | "TarFile":
            return opens_to_write(call) and not into_memory(call)
        case "replace":  # str.replace takes two, dataclasses.replace names its values
            return method and len(call.args) == 1 and not call.keywords
        case "savefig" | "savez" | "savez_compressed" | "savetxt" | "to_csv":
            return not into_memory(call)
        case "copy" | "move" | "link":
            return module in {"shutil", "os"}
    return method and name in METHODS and not (name == "touch" and call.args)


def into_memory(call):
    """Whether the first argument is an open file or a buffer, by its name."""
    return bool(call.args) and isinstance(call.args[0], ast.Name) and call.args[0].id in {"file", "buffer", "result"}


def saves_a_picture(name, call):
    """`image.save(path)`: a picture or arrays saved under a name instead of into an open file."""
    if name != "save" or not isinstance(call.func, ast.Attribute) or not call.args:
        return False
    first = call.args[0]
    return isinstance(first, ast.Name) and first.id in {"path", "out", "to", "target", "part", "fresh"}


@cache
def every_call():
    """(file, line, name, call) of the calls in the product, in files that may write."""
    tops = [ROOT / room for room in (*PACKAGES, "palpate")]
    files = [file for top in tops for file in (sorted(top.rglob("*.py")) if top.is_dir() else [top])]
    return [(file.relative_to(ROOT).as_posix(), *call) for file in files for call in calls(file)]


def test_json_with_numbers_that_are_not_finite_is_refused_by_one_function():
    files = {file for file, _, name, node in every_call()
             if name in {"dump", "dumps"} and ast.unparse(node.func).startswith("json.")}  # fmt: skip
    assert files == set(JSON_ELSEWHERE), "use palpate.protocols.canonical.json_text, or list it with the reason"


def test_every_file_is_written_by_the_one_writer():
    used, files = set(), []
    for file, line, name, node in every_call():
        excepted = next((key for key in EXCEPTIONS if file.startswith(key)), None)
        if file != WRITER and (writes(name, node) or saves_a_picture(name, node)):
            used.add(excepted)
            if excepted is None:
                files.append(f"{file}:{line}: {name}")
    assert files == [], "write it with palpate.protocols.files, or list it in EXCEPTIONS with the reason"
    assert used - {None} == set(EXCEPTIONS), "an exception that is no longer needed"


def test_nothing_in_protocols_but_the_writer_itself_touches_files():
    users = [
        file.name for file in sorted((ROOT / "protocols").glob("*.py"))
        if any(isinstance(node, ast.ImportFrom) and node.module == "palpate.protocols.files"
               for node in ast.walk(ast.parse(file.read_text("utf-8"))))
    ]  # fmt: skip
    assert users == []
