"""Check whether a participant's window can be opened on this station, and what it can show."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from palpate.devices.window.calibration import Calibration, read_calibration, station_file
from palpate.devices.window.commands_calibrate import describe_calibration
from palpate.devices.window.geometry import WindowError
from palpate.devices.window.shell_checks import demand_screen, demand_unscaled
from palpate.protocols.yaml_text import YamlError

SAMPLES = {"Latin": "Aéß", "Hangul": "가힣", "Devanagari": "कि", "Greek": "αω", "Cyrillic": "Яж", "Han": "漢"}
"""Characters that show whether a script can be drawn."""


def findings(lab: Path) -> dict[str, Any]:
    """Return calibration, screens, fonts by script and languages; `problems` are what prevents a window."""
    from palpate.devices.window.texts import languages

    problems: list[str] = []
    calibration, sizes = _calibration(lab, problems), _sizes(problems)
    if calibration is not None and sizes is not None:
        try:
            demand_screen(sizes, calibration.screen, calibration)
        except WindowError as error:
            problems.append(str(error))
    fonts = _fonts(problems)
    return {
        "file": str(station_file(lab)),
        "calibration": None if calibration is None else calibration.definition(),
        "screens": None if sizes is None else [list(size) for size in sizes],
        "fonts": fonts,
        "languages": list(languages()),
        "problems": problems,
    }


def describe_findings(state: dict[str, Any]) -> str:
    """Return a description of these findings."""
    calibration = state["calibration"]
    lines = [f"calibration  {state['file']}"]
    if calibration is not None:
        lines.append(f"             {describe_calibration(Calibration.from_definition(calibration))}")
        lines.append(f"             confirmed {calibration['confirmed_at']}")
    for number, (width, height) in enumerate(state["screens"] or ()):
        lines.append(f"screen {number}     {width}x{height} px")
    lines += [f"{script:<12} {file or 'no font'}" for script, file in state["fonts"].items()]
    lines.append(f"languages    {', '.join(state['languages'])}")
    lines += [f"PROBLEM      {problem}" for problem in state["problems"]]
    return "\n".join(lines if state["problems"] else [*lines, "a window can be opened here, as calibrated"])


def _calibration(lab: Path, problems: list[str]) -> Calibration | None:
    try:
        return read_calibration(lab)
    except (WindowError, YamlError) as error:
        problems.append(str(error))
        return None


def _sizes(problems: list[str]) -> list[tuple[int, int]] | None:
    from palpate.devices.window.shell import screen_sizes

    try:
        demand_unscaled(1.0)
        return screen_sizes()
    except WindowError as error:
        problems.append(str(error))
        return None


def _fonts(problems: list[str]) -> dict[str, str | None]:
    """Return which font file writes each script, adding to `problems`."""
    from palpate.devices.window.fonts import find_fonts

    try:
        fonts = find_fonts()
    except WindowError as error:
        problems.append(str(error))
        return {}
    faces = {script: fonts.face(text[0]) for script, text in SAMPLES.items()}
    return {script: None if face is None else face.path.name for script, face in faces.items()}
