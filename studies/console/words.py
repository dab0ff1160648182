"""The session in words: what the participant is doing, how long things take, and one line for each event."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palpate.devices.desk import Prompt
from palpate.devices.samples import described
from palpate.protocols.events import NS, Event
from palpate.protocols.forms import FORMS
from palpate.studies.console.board import Board

DOING = {
    "present with anchor": "feeling a reference",
    "present with wish": "feeling what was made from the sliders",
    "present": "feeling the stimulus",
    "instruct": "reading the instructions",
    "confirm with text": "waiting while the experimenter sets up",
    "confirm": "waiting while the screen is measured",
}
OVER = {"declined": "the participant declined", "ineligible": "the participant cannot take part"}
"""How a session ended, where "the session is ..." would not say it."""


def doing(body: Mapping[str, Any] | None, waits: bool = False) -> str:
    """What the participant is doing while the request of this body is performed, or the experimenter is to do it."""
    match body:
        case {"do": "present"} if waits:
            return "waiting for the stimulus"
        case {"do": "ask", "form": form, "items": items}:
            return counted(FORMS[form].doing if form in FORMS else f"answering {form}", len(items))
        case {"do": "sense", "device": device, "seconds": seconds}:
            return f"exploring while {str(device).replace('_', ' ')} records {seconds:g} s"
        case {"do": "rest", "done": done, "total": total}:
            return f"resting ({done} of {total} behind them)"
        case {"do": do, **more}:
            what = next((word for word in ("anchor", "wish", "text") if word in more), None)
            return DOING.get(do if what is None else f"{do} with {what}", "waiting")
        case _:
            return "waiting"


def counted(text: str, count: int) -> str:
    """A text with its {n} filled in, and in the singular for one: its plural is marked as (s)."""
    return text.replace("{n}", str(count)).replace("(s)", "" if count == 1 else "s")


def clock(seconds: float) -> str:
    """Minutes and seconds, and hours where there are some: 4:07, 1:02:30."""
    whole = int(seconds)
    hours, rest = divmod(whole, 3600)
    minutes = f"{rest // 60:02d}" if hours else f"{rest // 60}"
    return f"{hours}:{minutes}:{rest % 60:02d}" if hours else f"{minutes}:{rest % 60:02d}"


def about(seconds: float | None) -> str:
    """A duration as an estimate is told."""
    if seconds is None:
        return "time left: known after the first trial"
    if seconds < 90:
        return f"about {round(seconds, -1):.0f} s left"
    return f"about {round(seconds / 60):d} min left"


def how_to_answer(prompt: Prompt, by_line: bool = False) -> str:
    """What to press, or to write where orders are lines."""
    confirm = "confirm" if by_line else "Enter"
    if prompt.kind == "confirm":
        return f"{confirm} when it is done"
    default = "" if prompt.default is None else f"; {confirm} alone means {prompt.default:g}"
    return f"{'a number' if by_line else 'type the number, then Enter'}{default}"


def standing(board: Board) -> str:
    """Where the session is, in a few words."""
    if board.ended is not None:
        return OVER.get(board.ended, f"the session is {board.ended}")
    trial = board.current()
    if trial is None:
        return f"{len(board.done)} of {board.total} trials done"
    hidden = trial.block == "main" or _blocks_are_blind(board)
    block = "" if hidden else f" ({trial.block})"
    again = f", attempt {board.attempt}" if board.attempt > 1 else ""
    return f"trial {board.trial} of {board.total}{block}{again}"


def _blocks_are_blind(board: Board) -> bool:
    blocks = board.plan.study.order.blocks
    return blocks is not None and blocks.by in board.plan.study.blind


def line(event: Event, board: Board) -> str | None:
    """What a plain console says of an event, the board being that after it; None where it says nothing."""
    told = _line(event, board)
    return None if told is None else f"[{clock(event.t_ns / NS)}] {told}"


def _line(event: Event, board: Board) -> str | None:
    match event.kind:
        case "trial_started":
            return where(board)
        case "request" if event.trial is None:
            return doing(event.value)
        case "fault":
            return board.remarks[-1].text
        case "experimenter":
            return board.remarks[-1].text if event.value["do"] != "note" else f"note: {event.value['text']}"
        case "session_ended":
            return standing(board)
        case _:
            return None


def where(board: Board) -> str:
    """Where the session is, which stimulus is on and which comes next."""
    trial = board.current()
    if trial is None:
        return standing(board)
    coming, blind = board.coming(1), board.plan.study.blind
    then = f"; next {described(coming[0].stimulus, blind)}" if coming else ""
    return f"{standing(board)}: {described(trial.stimulus, blind)}{then}"
