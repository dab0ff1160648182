"""Names in BIDS: key-value pairs of letters and digits."""

from __future__ import annotations

import re

from palpate.analysis.exporting.source import Sat


def label(name: str) -> str:
    """A name as BIDS allows it within a file's name: letters and digits."""
    return re.sub(r"[^A-Za-z0-9]", "", name)


def folder_of(sat: Sat) -> str:
    """sub-P001/ses-01"""
    return f"sub-{sat.participant}/ses-{sat.number:02d}"


def stem_of(sat: Sat) -> str:
    """sub-P001_ses-01"""
    return folder_of(sat).replace("/", "_")
