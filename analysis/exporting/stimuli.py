"""The study's stimuli: their table, and their files if a licence allows sharing them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from palpate.analysis.exporting.source import Source
from palpate.analysis.exporting.tabular import Column, ExportRefused, Table
from palpate.protocols.files import file_sha256, write_bytes, write_text
from palpate.protocols.wording import count
from palpate.studies.catalogue import SHIPPED, names

FILE = "file"
"""The column of a stimulus table that names a file in the study's folder."""
LICENCES = ("LICENSE*", "LICENCE*", "NOTICE*")
SHIPPED_LICENCE = """\
The files in this folder are those of a study that Palpate ships: Palpate's licence holds for them,
GNU General Public License, version 3 or later (https://www.gnu.org/licenses/gpl-3.0.html), except where a LICENSE or
a NOTICE beside them says otherwise.
"""


@dataclass(frozen=True)
class StimulusFiles:
    """The stimulus files that are shared: path within the export -> source; `note` is the README's line about them."""

    files: dict[str, Path]
    notices: dict[str, Path]
    ours: bool
    note: str


def stimulus_table(source: Source, taken: frozenset[str] = frozenset()) -> Table:
    """Return all of the study's stimuli with their columns."""
    columns = list(dict.fromkeys(name for stimulus in source.study.stimuli for name in stimulus.columns))
    clash = {"stimulus", "sha256"} & set(columns) | taken & set(columns)
    if clash:
        raise ExportRefused(f"the stimulus table has a column {min(clash)!r}, which means something else in an export")
    meanings = {name: f"Column {name} of the study's stimulus table, as it stands there." for name in columns}
    if FILE in meanings:
        meanings[FILE] = "The stimulus' file, within the study's folder."
    return Table(
        "stimuli",
        "One row for each stimulus of the study.",
        (
            Column("stimulus", "The stimulus, as the trials name it.", key=True),
            *(Column(name, meaning) for name, meaning in meanings.items()),
            Column("sha256", "SHA-256 of the stimulus' file, where it has one."),
        ),
        lambda: (
            {"stimulus": stimulus.id, **stimulus.columns, "sha256": stimulus.sha256}
            for stimulus in source.study.stimuli
        ),
    )


def stimulus_files(source: Source, without: Collection[str] = ()) -> StimulusFiles:
    """Return the stimuli's files if the licence of the study's folder is known and the files are those presented."""
    if FILE in without:
        return StimulusFiles({}, {}, False, "The stimuli's files were left out.")
    digests = {
        stimulus.columns[FILE]: stimulus.sha256 for stimulus in source.study.stimuli if stimulus.columns.get(FILE)
    }
    if not digests:
        return StimulusFiles({}, {}, False, "The stimuli have no files.")
    study = names(source.lab).get(source.study.study)
    if study is None:
        return _no_files("the study's folder is neither among the lab's own nor shipped")
    folder = study.parent
    ours = folder.parent == SHIPPED
    notices = {path.relative_to(folder).as_posix(): path for form in LICENCES for path in folder.rglob(form)}
    if not ours and not any("/" not in name for name in notices):
        return _no_files("no LICENSE or NOTICE in the study's folder says that they may be shared")
    files = {name: folder / name for name in digests}
    changed = [name for name, path in files.items() if not path.is_file() or file_sha256(path) != digests[name]]
    if changed:
        return _no_files(f"{changed[0]} in the study's folder is not the file that was presented ({len(changed)} such)")
    return StimulusFiles(files, notices, ours, f"{count(len(files), 'file')} of stimuli, with the licence.")


def _no_files(why: str) -> StimulusFiles:
    return StimulusFiles({}, {}, False, f"The stimuli's files are not here: {why}. Their SHA-256 stand in the table.")


def copy_files(files: StimulusFiles, to: Path) -> None:
    """Copy the files and their licence notices."""
    for name, path in {**files.notices, **files.files}.items():
        write_bytes(to / name, path.read_bytes())
    if files.ours and files.files:
        write_text(to / "LICENCE.txt", SHIPPED_LICENCE)
