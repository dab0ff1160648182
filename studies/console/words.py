"""The session in words: what the participant is doing, how long things take, and one line for each event."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from palpate.devices.desk import Prompt
from palpate.devices.samples import described
from palpate.protocols.events import NS, Event
from palpate.protocols.forms import FORMS
from palpate.protocols.trial import Trial
from palpate.protocols.wording import phrase
from palpate.studies.console.status import SessionStatus, hides_level

DOING = {
    "present with anchor": "feeling a reference",
    "present with wish": "feeling what the sliders give",
    "present": "feeling the stimulus",
    "instruct": "reading the instructions",
    "confirm with text": "waiting while the experimenter sets up",
    "confirm": "waiting while the screen is measured",
    "choose": "waiting while the level is chosen",
    "show": "seeing whether the answer was right",
}
OVER = {"declined": "the participant declined", "ineligible": "the participant cannot take part"}
"""How a session ended, where "the session is ..." does not fit."""


def doing(body: Mapping[str, Any] | None, waits: bool = False) -> str:
    """Describe what the participant does during the request with this body; `waits`: until it is prepared."""
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


def doing_now(status: SessionStatus, waits: bool = False) -> str:
    """Describe what the participant does now, with the interval and its level where the study does not hide that."""
    trial, body = status.current(), status.doing
    if trial is None or body is None or waits or "interval" not in body:
        return doing(body, waits)
    of = getattr(getattr(trial.form, "intervals", None), "of", body["interval"])
    text = f"presenting {of} at once" if "sides" in body else f"presenting interval {body['interval']} of {of}"
    if hides_level(status.plan, trial):
        return text
    if body.get("blank"):
        return f"{text}, without a stimulus"
    level = body.get("level")
    levels = level if isinstance(level, list | tuple) else [level]
    return text if level is None else f"{text} at level {', '.join(f'{one:g}' for one in levels)}"


def counted(text: str, count: int) -> str:
    """Return a text with {n} replaced by a count, and its (s) by the plural or nothing."""
    return text.replace("{n}", str(count)).replace("(s)", "" if count == 1 else "s")


def clock(seconds: float) -> str:
    """Return a time as minutes and seconds, with hours if there are any: 4:07, 1:02:30."""
    whole = int(seconds)
    hours, rest = divmod(whole, 3600)
    minutes = f"{rest // 60:02d}" if hours else f"{rest // 60}"
    return f"{hours}:{minutes}:{rest % 60:02d}" if hours else f"{minutes}:{rest % 60:02d}"


def about(seconds: float | None) -> str:
    """Return an estimate of the time left, in words."""
    if seconds is None:
        return "time left: known after the first trial"
    if seconds < 90:
        return f"about {round(seconds, -1):.0f} s left"
    return f"about {round(seconds / 60):d} min left"


def how_to_answer(prompt: Prompt, by_line: bool = False) -> str:
    """Return which key to press, or which line to write where orders are lines."""
    confirm = "confirm" if by_line else "Enter"
    if prompt.kind == "confirm":
        return f"{confirm} when it is done"
    default = "" if prompt.default is None else f"; {confirm} alone means {prompt.default:g}"
    return f"{'a number' if by_line else 'type the number, then Enter'}{default}"


def standing(status: SessionStatus) -> str:
    """Return the state of the session in a few words."""
    if status.ended is not None:
        return OVER.get(status.ended, f"the session is {status.ended}")
    trial = status.current()
    total = f"at most {status.total}" if status.has_tracks else f"{status.total}"
    if trial is None:
        return f"{len(status.done)} of {total} trials done"
    blocks = status.plan.study.order.blocks
    hidden = trial.block == "main" or (blocks is not None and blocks.by in status.plan.study.blind)
    block = "" if hidden else f" ({trial.block})"
    again = f", attempt {status.attempt}" if status.attempt > 1 else ""
    return f"trial {status.trial} of {total}{block}{again}"


def line(event: Event, status: SessionStatus) -> str | None:
    """Return what a console of lines prints of an event, given the status after it; None if nothing."""
    match event.kind:
        case "trial_started":
            text = where(status)
        case "request" if event.trial is None:
            text = doing(event.value)
        case "experimenter" if event.value["do"] == "note":
            text = f"note: {event.value['text']}"
        case "experimenter" | "fault":
            text = status.remarks[-1].text
        case "session_ended":
            text = standing(status)
        case _:
            return None
    return f"[{clock(event.t_ns / NS)}] {text}"


def where(status: SessionStatus) -> str:
    """Return the state of the session, the present stimulus and the next one."""
    trial = status.current()
    if trial is None:
        return standing(status)
    coming, blind = status.coming(1), status.plan.study.blind
    then = f"; next {about_trial(coming[0], blind)}" if coming else ""
    return f"{standing(status)}: {about_trial(trial, blind)}{then}"


def about_trial(trial: Trial, blind: Sequence[str] = ()) -> str:
    """Return the stimulus of a trial, or all stimuli of a set."""
    return phrase(list(dict.fromkeys(described(side.stimulus, blind) for side in trial.each())))
