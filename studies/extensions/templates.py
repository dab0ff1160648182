"""Write an extension to begin with, from a template of its kind: a package, or a module in a lab."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.extensions import ExtensionError, is_own
from palpate.protocols.files import staged_files, write_text

FILES = Path(__file__).with_name("template_files")
EXTENSION, PART = "template_lab", "template_part"
"""The names in the templates, which the extension's and the part's own replace."""
ENDING = ".txt"
"""The ending of templates of code: those of tests and figures import rooms that this one may not."""
ENTRY_POINTS: Mapping[str, Mapping[str, str]] = {
    "device": {"devices": "DEVICE"},
    "task": {"tasks": "TASK"},
    "form": {"tasks": "TASK", "forms": "FORM"},
    "procedure": {"procedures": "PROCEDURE"},
    "need": {"devices": "DEVICE", "needs": "NEED"},
    "participant": {"participants": "PARTICIPANT"},
    "test": {"tests": "TEST"},
    "figure": {"figures": "FIGURE"},
}
"""The templates by kind: the parts that each brings, and the name of each in its module."""
SHARES: Mapping[str, Mapping[str, str]] = {"need": {"device.py": "device/__init__.py.txt"}}
"""Files of a template that are those of another one."""


def write_package(kind: str, name: str, out: Path | None = None) -> list[Path]:
    """Write an installable package with a module, studies and a test; return its files, pyproject.toml first.

    Raises ExtensionError for an unknown kind, a name that is none, and a file that exists.
    """
    extension, part = _names(kind, name)
    root = out or Path(extension)
    entries = "".join(
        f'\n[project.entry-points."palpate.{parts}"]\n"{name}" = "{extension}:{place}"\n'
        for parts, place in ENTRY_POINTS[kind].items()
    )
    files = dict(_filled(FILES / "package", extension, part))
    project = Path("pyproject.toml")
    files[project] += entries
    files |= {Path(extension) / path: text for path, text in _module(kind, extension, part)}
    return _write(root, {project: files.pop(project), **files})


def write_module(kind: str, name: str, lab: Path) -> list[Path]:
    """Write a module into LAB/extensions, and its studies into LAB/studies; return the files. Raises as above."""
    extension, part = _names(kind, name)
    if (single := lab / "extensions" / f"{extension}.py").exists():
        raise ExtensionError(f"{single} exists; choose another name, or add to it by hand what --out FOLDER writes")
    files = {}
    for path, text in _module(kind, extension, part):
        in_lab = path.parts[0] == "studies"
        files[path if in_lab else Path("extensions", extension) / path] = text
    return _write(lab, files)


def _names(kind: str, name: str) -> tuple[str, str]:
    if kind not in ENTRY_POINTS:
        raise ExtensionError(f"no template for the kind {kind!r}; {nearest(kind, ENTRY_POINTS)}")
    if not is_own(name):
        raise ExtensionError(f"{name!r}: a name such as acme.grip is expected, of a-z, 0-9 and _, with one dot")
    extension, _, part = name.partition(".")
    return extension, part


def _module(kind: str, extension: str, part: str) -> Iterator[tuple[Path, str]]:
    yield from _filled(FILES / kind, extension, part)
    for path, shared in SHARES.get(kind, {}).items():
        yield Path(path), _fill((FILES / shared).read_text(encoding="utf-8"), extension, part)


def _filled(folder: Path, extension: str, part: str) -> Iterator[tuple[Path, str]]:
    """Yield the files of a template with their names and texts, filled in."""
    for file in sorted(path for path in folder.rglob("*") if path.is_file()):
        path = _fill(file.relative_to(folder).as_posix().removesuffix(ENDING), extension, part)
        yield Path(path), _fill(file.read_text(encoding="utf-8"), extension, part)


def _fill(text: str, extension: str, part: str) -> str:
    return text.replace(EXTENSION, extension).replace(PART, part)


def _write(root: Path, files: Mapping[Path, str]) -> list[Path]:
    """Write all files into a folder, or none if one exists or cannot be written; return their paths."""
    for path in files:
        if (root / path).exists():
            raise ExtensionError(f"{root / path} exists; nothing is overwritten: choose another name or --out FOLDER")
    with staged_files(root) as draft:
        for path, text in files.items():
            (draft / path).parent.mkdir(parents=True, exist_ok=True)
            write_text(draft / path, text)
    return [root / path for path in files]
