"""The measured door and the four edits that its authors made of it by hand, as door profiles."""

from __future__ import annotations

from pathlib import Path

from palpate.modeling.doors.profile_files import read_profile
from palpate.signals.arrays import Array
from palpate.studies.catalogue import SHIPPED

STUDY = SHIPPED / "door_ratings"
FILES = {
    "actual": Path("profiles", "BC3_g0.csv"),
    **{f"edited_v{number}": Path("measured", "normalised", f"haptune_edited_v{number}.csv") for number in range(1, 5)},
}
"""The names of the source (HapTune), and each one's 621 points; `actual` is the door BC3_g0 of the study."""


def measured_doors() -> dict[str, Array]:
    """The forces (621,), in newtons, of the measured door (`actual`) and its four edits; the edits measure nothing.

    From files of studies/door_ratings, which `palpate doors normalise` made. Raises ModelDataError on a damaged one.
    """
    return {name: read_profile(STUDY / file) for name, file in FILES.items()}
