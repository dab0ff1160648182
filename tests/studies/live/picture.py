"""The picture of the console in the documentation: `python -m tests.studies.live.picture FILE`."""

from __future__ import annotations

import io
import re
import sys
from pathlib import Path

from rich.console import Console

from palpate.devices.samples import mounting
from palpate.protocols.canonical import canonical
from palpate.protocols.events import NS, Event
from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.session_state import SessionState
from palpate.protocols.trial import ParticipantRow
from palpate.studies.console.display import View
from palpate.studies.console.orders import Entry
from palpate.studies.console.page import page
from palpate.studies.console.status import status_of
from tests.studies.live.halls import sheets

MATERIALS = ("sandpaper P60", "cork", "steel mesh", "felt", "cardboard", "suede", "acrylic", "denim")
FORM = {"do": "ask", "form": "sliders", "items": ["a", "b", "c", "d"], "back": True, "previous": None}


def fifty() -> Plan:
    """A plan of fifty samples, shuffled, with a rest after every ten."""
    stimuli = [
        {"id": f"T{n:02d}", "columns": {"material": MATERIALS[n % 8], "position": f"box {1 + n % 9}"}}
        for n in range(1, 51)
    ]
    study = sheets(stimuli=stimuli, order={"design": "random"}, rest={"every": 10})
    return compile_plan(study, ParticipantRow("P007", None, 3), seed=4)


def half_way(trials: int = 19) -> SessionState:
    """The session once so many trials are over, twenty-eight seconds each, and the next sample is asked for."""
    header = {"rig": {"kind": "live", "twins": []}, "session": 1}
    state = SessionState()
    state.apply(Event(0, 0, "session_started", canonical(header)))
    seq, t_s = 1, 95.0

    def happen(kind: str, body: dict, number: int, later_s: float) -> None:
        nonlocal seq, t_s
        t_s += later_s
        state.apply(Event(seq, round(t_s * NS), kind, canonical(body), number, 1))
        seq += 1

    trial_body = {"stimulus": "", "block": "main"}
    for number in range(1, trials + 1):
        happen("trial_started", trial_body, number, 0.2)
        happen("request", {"do": "present", "stimulus": ""}, number, 0.0)
        if number == 12:
            happen("experimenter", {"do": "note", "text": "asked how long the break would be"}, number, 1.0)
        if number == 15:
            happen("experimenter", {"do": "pause"}, number, 2.0)
            happen("experimenter", {"do": "go_on"}, number, 61.0)
        if number == 17:
            happen("experimenter", {"do": "note", "text": "T29 was mounted late: the tape had come off"}, number, 2.0)
        happen("reply", {}, number, 8.0)
        happen("request", FORM, number, 0.0)
        happen("reply", {"answers": {}}, number, 19.5)
        happen("trial_ended", {"as": "answered"}, number, 0.1)
    happen("trial_started", trial_body, trials + 1, 0.2)
    happen("request", {"do": "present", "stimulus": ""}, trials + 1, 0.0)
    return state


def view() -> View:
    """What the experimenter sees then."""
    plan = fifty()
    status = status_of(plan, half_way())
    current = status.current()
    return View(
        status,
        prompt=mounting(current.stimulus) if current is not None else None,
        states={"screen": "1920x1080, 3.62 px/mm, en", "window": "changing_sample"},
        entry=Entry("note", "the headphones were put on again bef"),
    )


def drawn(width: int = 104, height: int = 25) -> Console:
    """A console that has drawn it, whatever terminal this process has."""
    console = Console(
        width=width, height=height, record=True, file=io.StringIO(), force_terminal=True, color_system="truecolor"
    )
    now = view()
    console.print(page(now, now.status.t_ns + 6 * NS, width, height), height=height)
    return console


def save(file: Path) -> None:
    """The picture as SVG, without fonts from elsewhere: it is drawn in the reader's own monospaced one."""
    svg = drawn().export_svg(title="palpate run texture_ratings", unique_id="console")
    alone = re.sub(r"\s*@font-face \{.*?\}", "", svg, flags=re.DOTALL)
    file.write_text("\n".join(line.rstrip() for line in alone.splitlines()) + "\n", encoding="utf-8")


def words() -> list[str]:
    """What the picture says, line by line."""
    return drawn().export_text().splitlines()


if __name__ == "__main__":
    save(Path(sys.argv[1]))
