"""The console's page: the board, the demand and the keys, laid out for the size of the terminal."""

from __future__ import annotations

from rich import box
from rich.cells import cell_len
from rich.console import Group, RenderableType
from rich.layout import Layout
from rich.padding import Padding
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from palpate.devices.samples import described
from palpate.protocols.events import NS
from palpate.studies.console.board import Board
from palpate.studies.console.entry import KEYS, Entry
from palpate.studies.console.view import View
from palpate.studies.console.words import about, clock, doing, how_to_answer, standing

HELP = (
    ("Enter", "the demand is done: the sample is in place, the number is typed"),
    ("p", "pause; once more to go on. Paused time counts nowhere"),
    ("r", "repeat this trial from its start; what was answered in it is kept, but does not count"),
    ("R", "go back and repeat the trial before this one"),
    ("n", "write a note into the session's record (Esc leaves it)"),
    ("a", "abort the session for good: type abort and, if you like, why"),
    ("q", "quit for now: go on later with palpate resume"),
)
MARKS = {"live": ("LIVE", "bold white on dark_green"), "rehearsal": ("REHEARSAL", "bold black on yellow")}
ASKING = {"note": "note", "abort": "type abort, a blank and the reason", "number": "number"}


def page(view: View, t_ns: int, width: int, height: int = 30) -> Layout:
    """The whole page at session time t_ns, for a terminal of so many columns and rows."""
    layout = Layout()
    layout.split_column(
        Layout(_title(view.board), size=1),
        Layout(_demand(view), size=4 + _further_lines(view, width)),
        Layout(_progress(view.board, t_ns), size=3),
        Layout(_help() if view.help else _middle(view, t_ns, width, height)),
        Layout(_keys(), size=1),
        Layout(entry_line(view.entry, view.hint, width), size=1),
    )
    return layout


def entry_line(entry: Entry, hint: str, width: int) -> Text:
    """The last line: the end of what is being typed, or a word to the typist."""
    if not entry.typing:
        return Text(f" {hint}", style="yellow", no_wrap=True)
    asked = f" {ASKING[entry.kind]}: "
    shown = entry.text
    while cell_len(asked) + cell_len(shown) + 1 > width and shown:
        shown = shown[1:]
    return Text.assemble((asked, "bold cyan"), shown, ("█", "blink"), no_wrap=True)


def _title(board: Board) -> RenderableType:
    study, who = board.plan.study, board.plan.who
    rig = board.header.get("rig", {})
    mark, style = MARKS.get(rig.get("kind", ""), ("", ""))
    simulated = ", ".join(each.replace("_", " ") for each in rig.get("twins", ()))
    row = Table.grid(expand=True)
    row.add_column(ratio=1, no_wrap=True)
    row.add_column(justify="right", no_wrap=True)
    left = Text.assemble((f" {mark} ", style), "  ", (study.title or study.study, "bold"))
    if simulated:
        left.append(f"   simulated: {simulated}", style="yellow")
    if board.plan.study.blind:
        left.append(f"   blind: {', '.join(board.plan.study.blind)}", style="yellow")
    group = f"  group {who.group}" if who.group is not None else ""
    row.add_row(left, f"{who.participant}{group}  row {who.row}  session {board.header.get('session', 1)} ")
    return row


def _demand(view: View) -> RenderableType:
    board = view.board
    if view.prompt is not None and not board.paused:
        text = Text.assemble((view.prompt.text, "bold bright_yellow"), "\n", (how_to_answer(view.prompt), "dim"))
        return Panel(text, title="your turn", title_align="left", border_style="bright_yellow", box=box.HEAVY)
    if board.pause is not None:
        told = "Paused. The participant sees the pause page.\np goes on"
        if board.pause.by_participant:
            told = "The participant rests, and goes on when ready.\np ends the rest"
        text = Text(told, style="bold yellow")
        return Panel(
            text,
            title="resting" if board.pause.by_participant else "paused",
            title_align="left",
            border_style="yellow",
            box=box.ROUNDED,
        )
    told = "The session is over." if board.ended is not None else "Nothing to do for you now."
    return Panel(Text(told, style="dim"), border_style="bright_black", box=box.ROUNDED)


def _further_lines(view: View, width: int) -> int:
    """How many lines more than one the demand takes, at most five."""
    told = 0 if view.prompt is None or view.board.paused else cell_len(view.prompt.text)
    return min(told // max(width - 8, 20), 5)


def _progress(board: Board, t_ns: int) -> RenderableType:
    line = Table.grid(expand=True, padding=(0, 1))
    line.add_column(no_wrap=True)
    line.add_column(ratio=1)
    line.add_column(justify="right", no_wrap=True)
    share = f"{len(board.done) / board.total:.0%}"
    line.add_row(
        f" {standing(board)}",
        ProgressBar(board.total, len(board.done), style="grey37", complete_style="cyan", finished_style="cyan"),
        f"{share} ",
    )
    times = Text(f" {clock(t_ns / NS)} since the start, {about(board.left_s(t_ns))}", style="dim")
    if board.pause is not None:
        times.append(f"   paused for {clock((t_ns - board.pause.begun_ns) / NS)}", style="yellow")
    return Padding(Group(line, times), (0, 0, 1, 0))


def _middle(view: View, t_ns: int, width: int, height: int) -> RenderableType:
    """What there is room for: all four panels, the upper two, or the samples alone."""
    participant = Layout(_panel("participant", _participant(view, t_ns)))
    stimuli = Layout(_panel("stimuli", _stimuli(view.board)))
    if height < 20:
        return stimuli
    middle, upper, lower = Layout(), Layout(size=5), Layout()
    if width < 70 or height < 22:
        middle.split_column(participant, stimuli)
        return middle
    upper.split_row(participant, stimuli)
    lower.split_row(
        Layout(_panel("window and devices", _states(view))), Layout(_panel("remarks", _remarks(view.board)))
    )
    middle.split_column(upper, lower)
    return middle


def _panel(title: str, inside: RenderableType) -> Panel:
    return Panel(inside, title=title, title_align="left", border_style="bright_black", box=box.ROUNDED)


def _participant(view: View, t_ns: int) -> RenderableType:
    board = view.board
    if board.doing is None:
        return Text()
    told = doing(board.doing, waits=view.prompt is not None)
    return Text.assemble((told, "bold"), "\n", (f"for {clock(board.doing_s(t_ns))}", "dim"))


def _stimuli(board: Board) -> RenderableType:
    rows = Table.grid(padding=(0, 1))
    rows.add_column(style="dim", no_wrap=True, min_width=4)
    rows.add_column(overflow="ellipsis", no_wrap=True)
    trial, blind = board.current(), board.plan.study.blind
    if trial is not None:
        rows.add_row("now", Text(described(trial.stimulus, blind), style="bold"))
    for name, coming in zip(("next", "then"), board.coming(2), strict=False):
        rest = "  (after a rest)" if coming.rest_before else ""
        rows.add_row(name, f"{described(coming.stimulus, blind)}{rest}")
    if not board.coming(1):
        rows.add_row("next", Text("none: this is the last", style="dim"))
    return rows


def _states(view: View) -> RenderableType:
    rows = Table.grid(padding=(0, 1))
    rows.add_column(style="dim", no_wrap=True, min_width=4)
    rows.add_column(overflow="ellipsis", no_wrap=True)
    for key, value in view.states.items():
        rows.add_row(key.replace("_", " "), Text(_short(value)))
    return rows


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value).replace("_", " ")


def _remarks(board: Board) -> RenderableType:
    rows = Table.grid(padding=(0, 1))
    rows.add_column(style="dim", no_wrap=True, justify="right")
    rows.add_column()
    for remark in reversed(board.remarks):
        rows.add_row(clock(remark.t_ns / NS), Text(remark.text))
    return rows


def _keys() -> RenderableType:
    line = Text(" ", no_wrap=True, overflow="ellipsis")
    for key, meaning in KEYS:
        line.append(key, style="bold").append(f" {meaning}  ", style="dim")
    return line


def _help() -> RenderableType:
    rows = Table.grid(padding=(0, 2))
    rows.add_column(style="bold", no_wrap=True, justify="right")
    rows.add_column()
    for key, meaning in HELP:
        rows.add_row(key, meaning)
    return _panel("keys: any key closes this", rows)
