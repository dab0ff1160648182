"""Numbers, times and states as text on the monitor's page."""

from __future__ import annotations

from datetime import datetime

from palpate.analysis.ratings.diagnostics import Diagnostic
from palpate.analysis.reports.tables import NONE

STATUS = {
    "running": "● running",
    "paused": "‖ paused",
    "interrupted": "◐ interrupted",
    "complete": "✓ complete",
    "aborted": "✕ aborted",
    "declined": "✕ declined",
    "ineligible": "✕ not eligible",
    "allocated": "○ allocated",
    "released": "✕ released",
    "withdrawn": "✕ withdrawn",
    "free": "free",
}


def duration(seconds: float | None) -> str:
    """Return a time span: 8 s, 12 min 04 s, 1 h 02 min, 3 days."""
    if seconds is None:
        return NONE
    whole = round(max(0.0, seconds))
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    if whole < 48 * 3600:
        return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    return f"{whole // 86400} days"


def rough(seconds: float | None) -> str:
    """Return an estimated time: to ten seconds, from two minutes on to the minute."""
    if seconds is None:
        return NONE
    if seconds < 120:
        return f"about {max(10, round(seconds / 10) * 10)} s"
    minutes = round(seconds / 60)
    return f"about {minutes} min" if minutes < 60 else f"about {minutes // 60} h {minutes % 60:02d} min"


def clock(at: float | None, now: float) -> str:
    """Return a time of day, with the date if it is not today's."""
    if at is None:
        return NONE
    then, today = datetime.fromtimestamp(at), datetime.fromtimestamp(now)
    if then.date() == today.date():
        return f"{then:%H:%M}"
    return f"{then.day} {then:%b}{'' if then.year == today.year else f' {then.year}'}, {then:%H:%M}"


def exact_clock(at: float) -> str:
    """Return a time of day to the second."""
    return f"{datetime.fromtimestamp(at):%H:%M:%S}"


def sign(diagnostic: Diagnostic) -> str:
    """Return a diagnostic's number in its unit."""
    value = diagnostic.value
    if value is None:
        return NONE
    match diagnostic.unit:
        case "share" | "range":
            return f"{value:.0%}" if value == 0 or value >= 0.1 else f"{value:.1%}"
        case "s":
            return f"{value:.1f} s"
        case "r":
            return f"{value:.2f}".replace("-", "−")
        case _:
            return f"{value:g}"
