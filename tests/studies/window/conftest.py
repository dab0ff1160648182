"""A virtual display, and a lab whose screen is calibrated to it."""

from __future__ import annotations

import pytest

from benchmarks.window.display import virtual_display
from benchmarks.window.hand import Hand
from palpate.devices.window.calibration import Calibration, write_calibration
from palpate.studies.participants.lab_template import make_lab
from palpate.studies.participants.people import add
from palpate.studies.participants.registry import open_registry

SIZE, PX_PER_MM = (1280, 720), 3.6
WRITTEN = "smothrundy0123456789 ."


@pytest.fixture
def hand():
    with virtual_display(*SIZE) as display:
        one = Hand(display)
        one.add_keys_for(WRITTEN)
        yield one
        one.close()


@pytest.fixture
def lab(tmp_path):
    """A lab that may run real sessions: consent filled in, P001 known, this station's screen calibrated."""
    path = tmp_path / "lab"
    make_lab(path)
    for consent in path.glob("consent*.md"):
        consent.write_text(consent.read_text().replace("[", "").replace("]", ""))
    add(open_registry(path), "P001")
    write_calibration(path, Calibration(SIZE, PX_PER_MM, 0, "2026-01-01"))
    return path
