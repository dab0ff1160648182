"""What `palpate extensions list` and `check` print: the extensions that are here, their parts, and their contracts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from palpate.protocols.contract import Verdict
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.extensions import PARTS, ExtensionError, extension_of, used
from palpate.protocols.registry import Registry, load_object
from palpate.studies.catalogue import STUDY_FILE, StudyFiles, names, read_study
from palpate.studies.extensions.finder import Found, LabExtensions, parts_declared

REGISTRIES: Mapping[str, str] = {
    "tasks": "palpate.protocols.known_tasks:TASKS",
    "forms": "palpate.protocols.forms:FORMS",
    "needs": "palpate.protocols.needs:NEEDS",
    "procedures": "palpate.studies.procedures.adviser:KINDS",
    "devices": "palpate.devices.kinds:KINDS",
    "participants": "palpate.protocols.simulated_participants:KINDS",
    "tests": "palpate.analysis.plans.kinds:TESTS",
    "figures": "palpate.analysis.plans.kinds:FIGURES",
}
"""The registry of each kind of parts. Those of rooms above this one are named by their places alone."""
CONTRACTS: Mapping[str, str] = {
    "tasks": "palpate.studies.extensions.contract:check_task",
    "forms": "palpate.studies.extensions.contract:check_form",
    "needs": "palpate.studies.extensions.contract:check_need",
    "procedures": "palpate.studies.extensions.contract:check_procedure",
    "devices": "palpate.devices.contract:check_device",
    "participants": "palpate.studies.extensions.contract:check_participant",
    "tests": "palpate.analysis.regenerating.contract:check_test",
    "figures": "palpate.analysis.regenerating.contract:check_figure",
}
STUDIES = "studies"
"""The folder of an extension, or of a lab, with studies that name its parts."""
PLAN_FILE = "analysis.yaml"
OF_PLANS = ("tests", "figures")
"""The kinds of parts that plans name, which are tried on a sample."""


def check(name: str, lab: Path = Path()) -> list[Verdict]:
    """Return the verdicts of the contracts on a part (`acme.grip`), or on all parts of an extension (`acme`).

    This is what `palpate extensions check` prints, and what an extension's own tests call. Parts are looked for in the
    lab and among the installed packages. Raises ExtensionError if there is no such part, or it cannot be imported.
    """
    with used(LabExtensions(lab)) as extensions:
        found = extensions.find(extension_of(name))
        parts = [(kind, part) for kind, several in _parts(found, extensions).items() for part in several]
        named = [(kind, part) for kind, part in parts if name in (found.name, part)]
        if not named:
            near = nearest(name, [part for _, part in parts]) if parts else "it brings no part"
            raise ExtensionError(f"the extension {found.name!r} has no part {name!r}; {near}")
        studies, broken = _studies(found, lab)
        tried = [verdict for kind, part in named for verdict in _verdicts(kind, part, studies, lab)]
        return [*tried, *(Verdict(found.name, "its studies can be read", problem) for problem in broken)]


def _parts(found: Found, extensions: LabExtensions) -> Mapping[str, Sequence[str]]:
    """Return the names of an extension's parts by kind, which is imported."""
    extensions.load(found.name)
    return {kind: list(extensions.loaded[found.name].parts.get(kind, {})) for kind in PARTS}


def _verdicts(kind: str, part: str, studies: Sequence[StudyFiles], lab: Path) -> list[Verdict]:
    registry: Registry[Any] = load_object(REGISTRIES[kind])
    try:
        built = registry[part]
    except ExtensionError as error:
        return [Verdict(part, f"it is what parts among {kind} are", str(error))]
    contract = load_object(CONTRACTS[kind])
    if kind == "devices":
        return list(contract(part, built))
    named = [files for files in studies if _names(files, kind, part)]
    if kind in OF_PLANS:
        return list(contract(part, built, named, load_object("palpate.studies.extensions.contract:write_sample")))
    return list(contract(part, built, named, lab))


def _studies(found: Found, lab: Path) -> tuple[list[StudyFiles], list[str]]:
    """Return the studies of a lab and of an extension, and why those cannot be read that name the extension."""
    own = [path for folder in found.sources for path in sorted((folder / STUDIES).glob(f"*/{STUDY_FILE}"))]
    studies, broken = [], []
    for path in (*own, *names(lab).values()):
        try:
            studies.append(read_study(path))
        except ValueError as error:
            if f"{found.name}." in path.read_text(encoding="utf-8", errors="replace"):
                broken.append(str(error))
    return studies, broken


def _names(files: StudyFiles, kind: str, part: str) -> bool:
    """Return whether a study, or its plan, names the part; one that has a form is one whose task makes it."""
    from palpate.protocols.reading import own_parts

    if kind in OF_PLANS:
        plan = files.folder / PLAN_FILE
        return plan.is_file() and part in plan.read_text(encoding="utf-8")
    if kind == "forms":
        tasks = [name for _, of, name in own_parts(files.study) if of == "tasks"]
        return any(extension_of(name) == extension_of(part) for name in tasks)
    return any(name == part for _, of, name in own_parts(files.study) if of == kind)


def listed(lab: Path) -> list[dict[str, Any]]:
    """Return a row for each extension, as `palpate extensions list --json` prints it, without importing any.

    Each has extension, where, conflicts (where others of its name lie), package and version, or else sha256, allowed
    (False: lab.yaml does not allow its code), parts (names by kind), and problem if its file cannot be read.
    """
    extensions = LabExtensions(lab)
    return [_described(found, extensions) for found in extensions.all_found]


def _described(found: Found, extensions: LabExtensions) -> dict[str, Any]:
    conflicts = [other.where for other in extensions.all_found if other.name == found.name and other is not found]
    row: dict[str, Any] = {"extension": found.name, "where": found.where, "conflicts": conflicts}
    dist = found.distribution
    row |= {"package": dist.name, "version": dist.version} if dist is not None else {"sha256": found.sha256}
    row["allowed"] = found.path is None or extensions.allowed
    try:
        row["parts"] = {kind: list(parts) for kind, parts in parts_declared(found).items()}
    except (SyntaxError, ValueError) as error:
        row |= {"parts": {}, "problem": f"{type(error).__name__}: {error}"}
    return row
