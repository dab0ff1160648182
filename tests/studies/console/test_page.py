"""The console's page says what the experimenter needs, at every size of terminal."""

from __future__ import annotations

import html
import io
import re
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from palpate.devices.desk import Prompt
from palpate.devices.samples import mounting
from palpate.protocols import study
from palpate.protocols.canonical import canonical
from palpate.protocols.events import NS, Event
from palpate.protocols.session_state import SessionState
from palpate.studies.console.display import View
from palpate.studies.console.orders import IDLE, Entry
from palpate.studies.console.page import page
from palpate.studies.console.status import status_of
from palpate.studies.console.words import where
from tests.studies.live.halls import sheets_plan
from tests.studies.live.picture import fifty, half_way, view, words

PICTURE = Path(__file__).resolve().parents[3] / "docs" / "pictures" / "console.svg"


def printed(shown: View, width: int = 100, height: int = 28, t_s: float = 0.0) -> str:
    console = Console(width=width, height=height, file=io.StringIO())
    console.print(page(shown, shown.status.t_ns + round(t_s * NS), width, height), height=height)
    return console.file.getvalue()


def half_way_and(*events):
    """The status half way through a session, after these things more."""
    state = half_way()
    for seq, (kind, body) in enumerate(events, start=99):
        state.apply(Event(seq, state.t_ns, kind, canonical(body), 20, 1))
    return status_of(fifty(), state)


@pytest.mark.parametrize(("width", "height"), [(60, 16), (80, 24), (100, 28), (200, 60)])
def test_the_demand_the_samples_and_the_entry_are_seen_at_every_size(width, height):
    text = printed(view(), width, height)
    lines = text.splitlines()
    assert len(lines) == height and max(map(len, lines)) <= width
    for expected in ("Put in place: T05 (suede, box 6)", "trial 20 of 50", "next", "T39", "38%", "min left", "note:"):
        assert expected in text


def test_the_samples_of_the_next_two_trials_are_named():
    text = printed(view())
    assert re.search(r"next +T39 \(denim, box 4\) +\(after a rest\)", text)
    assert re.search(r"then +T48 \(sandpaper P60, box 4\)", text)


def test_a_long_line_being_typed_shows_its_end():
    text = printed(replace(view(), entry=Entry("note", "x" * 300 + "END")), 80, 24)
    assert "END█" in text.splitlines()[-1]


def test_a_pause_covers_the_demand_until_the_session_goes_on():
    status = half_way_and(("experimenter", {"do": "pause"}))
    text = printed(replace(view(), status=status), t_s=75)
    assert "p continues" in text and "paused for 1:15" in text and "Enter when it is done" not in text


def test_a_blind_console_shows_neither_the_column_nor_the_id_and_says_so():
    plan = view().status.plan
    blind = plan.study.model_copy(update={"console": study.Console(blind=("material",))})
    status = replace(view().status, plan=replace(plan, study=blind))
    text = printed(replace(view(), status=status, prompt=mounting(status.current().stimulus, blind.blind)))
    assert "blind: material" in text and "T39" not in text and "denim" not in text and "box 4" in text
    assert "T39" not in where(status) and "T39" in where(view().status)


def test_a_rest_of_the_participant_is_shown_as_a_rest():
    status = half_way_and(("experimenter", {"do": "pause", "by": "participant"}))
    text = printed(replace(view(), status=status), t_s=75)
    assert "The participant rests" in text and "p ends the rest" in text and "the participant rests" in text


def test_the_end_is_asked_for_although_the_session_was_paused_when_it_was_aborted():
    status = half_way_and(
        ("experimenter", {"do": "pause"}), ("experimenter", {"do": "abort", "text": "ill"}),
        ("session_ended", {"as": "aborted", "trials": 50}),
    )  # fmt: skip
    text = printed(replace(view(), status=status, prompt=Prompt("The session is over.")))
    assert "The session is over." in text and "the session is aborted" in text and "aborted: ill" in text


def test_stand_ins_and_rehearsals_are_marked():
    def marked(rig):
        return printed(View(status_of(sheets_plan(), SessionState({"rig": rig, "session": 2})))).splitlines()[0]

    assert "LIVE" in marked({"kind": "live", "twins": ["door_generator"]})
    assert "simulated: door generator" in marked({"kind": "live", "twins": ["door_generator"]})
    assert "REHEARSAL" in marked({"kind": "rehearsal"}) and "session 2" in marked({"kind": "rehearsal"})


def test_markup_in_a_note_or_a_label_is_text():
    shown = replace(view(), entry=IDLE, hint="[bold]odd[/x]", prompt=Prompt("[red]T07[/nope]"), states={"a": "[/b]"})
    text = printed(shown)
    assert "[red]T07[/nope]" in text and "[bold]odd[/x]" in text and "[/b]" in text


def test_the_picture_in_the_documentation_is_what_the_console_shows():
    cells = re.findall(r"<text[^>]*clip-path=\"url\(#console-line-(\d+)\)\">([^<]*)</text>", PICTURE.read_text("utf-8"))
    lines: dict[int, str] = {}
    for number, text in cells:
        lines[int(number)] = lines.get(int(number), "") + html.unescape(text).replace("\xa0", " ")
    shown = ["".join(lines.get(n, "").split()) for n in range(25)]
    assert shown == ["".join(line.split()) for line in words()]
