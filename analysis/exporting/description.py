"""The description of a data set: name, licence, authors, and a text for readers of its folder."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.analysis.exporting.guard import Guard
from palpate.analysis.exporting.source import Source
from palpate.analysis.exporting.tables import DataSet
from palpate.analysis.exporting.tabular import ExportRefused
from palpate.protocols.canonical import json_text
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.extras import installed_version
from palpate.protocols.wording import count

LAB_DESCRIPTION = "dataset_description.json"
"""The file in the lab's folder with further metadata of its data, by those BIDS keys that a lab may set."""
NO_LICENCE = "None stated: all rights reserved"
_TEXTS = ("License", "Acknowledgements", "HowToAcknowledge", "DatasetDOI")
_LISTS = ("Authors", "Funding", "EthicsApprovals", "ReferencesAndLinks", "Keywords")


@dataclass(frozen=True)
class Description:
    """The data set's name, a one-sentence summary, and the lab's own metadata."""

    name: str
    description: str
    simulated: bool
    dated: bool = False
    of_lab: dict[str, Any] = field(default_factory=dict)

    @property
    def licence(self) -> str:
        """The lab's licence, or a statement that there is none."""
        return str(self.of_lab.get("License", NO_LICENCE))


def describe(source: Source, dated: bool = False) -> Description:
    """Return the description of the data set.

    Raises ExportRefused where the lab's own description is unusable.
    """
    study = source.study
    title = study.title or study.study
    people, sessions = count(len(source.participants), "participant"), count(len(source.sessions), "session")
    summary = f"{people}, {sessions} of the study {study.study} ({title})."
    if source.simulated:
        summary += " SIMULATED: no person gave these answers, or a device was a twin."
    name = f"{title} (simulated)" if source.simulated else title
    return Description(name, summary, source.simulated, dated, _read_lab_description(source.lab / LAB_DESCRIPTION))


def palpate_version() -> str:
    """Return the version of Palpate that exports."""
    return installed_version("palpate") or "not installed"


def readme_text(description: Description, source: Source, holds: Sequence[str]) -> str:
    """Return the README: a summary, the contents, what was left out and why. `holds` are lines about the format."""
    never = [why for _, why in source.left_out if why.startswith("the participant ")]
    others = [
        f"{session.participant}, session {session.session.rpartition('/')[2]}: {why}"
        for session, why in source.left_out
        if why not in never
    ]
    lines = (
        [f"Left out because people withdrew, declined or were not eligible: {count(len(never), 'session')}."]
        if never
        else []
    )
    left_out = lines + (["Sessions not included:", "", *(f"- {line}" for line in others)] if others else [])
    return "\n".join([
        f"# {description.name}", "",
        *(["**Simulated data: no person gave these answers.** They show the data's form and are not a finding.", ""]
          if description.simulated else []),
        description.description, "",
        f"Licence: {description.licence}. Exported by Palpate {palpate_version()}; study definition"
        f" {source.digest}.", "",
        "## What is here", "", *(f"- {line}" for line in holds), "",
        "## Who is here", "",
        "Participants appear by pseudonym. Names and contacts are in no file that this data set was made from. The",
        "experimenter's notes and the consent form are not included. Times are seconds since the session began;",
        "the table of sessions says when." if description.dated else "when that was, is not included.",
        "Ages above 89 read 89. People who withdrew, declined or were not eligible are not included.",
        "", *left_out, "",
    ])  # fmt: skip


def changes_text(source: Source) -> str:
    """Return CHANGES in the form that BIDS requires, without a date, since dates do not leave the lab."""
    sessions = count(len(source.sessions), "session")
    return f"1.0.0\n  - Exported by Palpate {palpate_version()}: {sessions}, study {source.digest[:12]}.\n"


def json_for_people(value: Any) -> str:
    """Return indented JSON for human readers."""
    return json_text(value, indent=2)


def _read_lab_description(file: Path) -> dict[str, Any]:
    if not file.is_file():
        return {}
    try:
        data = json.loads(file.read_text("utf-8-sig"))
    except ValueError as error:
        raise ExportRefused(f"{file}: this is not JSON ({error})") from None
    if not isinstance(data, dict):
        raise ExportRefused(f'{file}: an object is expected, as {{"Authors": ["A. Author"], "License": "CC-BY-4.0"}}')
    for key, value in data.items():
        where = f"{file}: {key}"
        if key not in (*_TEXTS, *_LISTS):
            raise ExportRefused(f"{where}: not a key that a lab can set; {nearest(key, (*_TEXTS, *_LISTS))}")
        if key in _TEXTS and not (isinstance(value, str) and value.strip()):
            raise ExportRefused(f"{where}: found {value!r:.60}, a text is expected")
        if key in _LISTS and not (isinstance(value, list) and value and all(isinstance(v, str) and v for v in value)):
            raise ExportRefused(f"{where}: found {value!r:.60}, a list of texts is expected")
    return data


def withheld_lines(data_set: DataSet) -> list[str]:
    """Return a line for each question whose answers few people share, for the README."""
    return [f"So few could be recognised: {line}" for line in data_set.withheld]


def redacted_lines(guard: Guard) -> list[str]:
    """Return a line about redacted texts if there are any."""
    return [f"Blackened, because it looked as if it identifies a person: {place}." for place in guard.redacted]
