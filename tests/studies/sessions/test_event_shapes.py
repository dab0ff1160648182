"""A ledger whose chain is good and whose events are of another shape is named; the others are collected."""

import json
import shutil
import sqlite3
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from palpate.analysis.monitoring.following import follow
from palpate.analysis.streams.recorded_streams import StreamError, attempts_of, counting_attempts, streams_in
from palpate.protocols.canonical import canonical
from palpate.protocols.events import Event, event_hash
from palpate.protocols.runner import Divergence
from palpate.studies.collecting.collect import CollectError, collect, open_database
from palpate.studies.participants.export import demographics
from palpate.studies.sessions.ledger_schema import SEED, run_note_hash
from palpate.studies.sessions.record import LedgerError, read
from palpate.studies.sessions.replay import replay

RECORDED = Path(__file__).parents[2] / "recorded"
FORMAT_1 = RECORDED / "sessions" / "doors_small_P001_s1.sqlite"
FORMAT_2 = RECORDED / "ten" / "door_capture_P001_s1.sqlite"
FORMAT_3 = next((RECORDED / "rendered").glob("*.sqlite"))
SOURCES = (FORMAT_1, FORMAT_2, FORMAT_3, RECORDED / "ten" / "texture_adjectives_P001_s1.sqlite")


@cache
def recorded(source):
    return read(source)


def forged(source: Path, to: Path, changes: dict[int, object]) -> Path:
    """Copy a ledger with other bodies for some events and both chains computed again: only the shape is wrong."""
    record = recorded(source)
    shutil.copy(source, to)
    links, head = [], SEED
    with sqlite3.connect(to) as file:
        for event in record.events:
            body = changes.get(event.seq, event.body)
            other = replace(event, body=body if isinstance(body, bytes) else canonical(body))
            head = event_hash(head, other)
            links.append(head)
            file.execute("UPDATE events SET body = ?, hash = ? WHERE seq = ?", (other.body.decode(), head, event.seq))
        previous = SEED
        for n, note in enumerate(record.run_notes):
            then = links[note.events - 1]
            previous = run_note_hash(previous, n, note.kind, note.events, then, note.body)
            file.execute("UPDATE sittings SET head = ?, hash = ? WHERE n = ?", (then, previous, n))
    file.close()
    return to


def first(source, kind, after=lambda event: True):
    return next(event for event in recorded(source).events if event.kind == kind and after(event))


@pytest.mark.parametrize("source", [FORMAT_1, FORMAT_2, FORMAT_3])
@pytest.mark.parametrize(
    ("kind", "body", "expected"),
    [
        ("session_started", {}, "study is missing"),
        ("session_started", "AAA", "an object with study, participant"),
        ("trial_started", "value", "an object with stimulus, block is expected, found 'value'"),
        ("trial_ended", None, "an object with as is expected, found None"),
        ("request", [], r"an object with do is expected, found \[\]"),
        ("request", {"do": "ask", "form": "x", "items": [1], "back": False, "previous": None}, "items: a list, each"),
        ("reply", [{}], r"an object is expected, found \[\{\}\]"),
        ("reply", b'{"seconds":1e999}', "canonical JSON is expected"),
        ("reply", b'{"seconds": 1}', "canonical JSON is expected"),
        ("reply", b"[" * 99_999 + b"]" * 99_999, "canonical JSON is expected"),
        ("reply", {"go": "try"}, "go: only the reply to a form|answers is missing"),
        ("session_ended", "AAA", "an object with trials is expected, found 'AAA'"),
    ],
)  # fmt: skip
def test_an_event_of_another_shape_is_named(tmp_path, source, kind, body, expected):
    seq = first(source, kind).seq
    path = forged(source, tmp_path / "x.sqlite", {seq: body})
    with pytest.raises(LedgerError, match=rf"x\.sqlite: event {seq} \({kind}\) is not one .*: .*{expected}"):
        read(path)


@pytest.mark.parametrize(
    ("answers", "expected"),
    [
        ({"answers": "high"}, "answers: an object is expected"),
        ({"answers": {}}, "answers: Easy-to-pull is missing: a number is expected"),
        ({"answers": {"Easy-to-pull": "x"}}, "answers: Easy-to-pull: a number is expected, found 'x'"),
        ({"seconds": 1.0}, "answers is missing"),
    ],
)
def test_answers_that_do_not_fit_their_form_are_named(tmp_path, answers, expected):
    seq = first(FORMAT_1, "reply", lambda event: event.trial is not None and "answers" in event.value).seq
    with pytest.raises(LedgerError, match=rf"event {seq} \(reply\) .*{expected}"):
        read(forged(FORMAT_1, tmp_path / "x.sqlite", {seq: answers}))


@pytest.mark.parametrize(
    ("statement", "expected"),
    [
        ("UPDATE samples SET form = replace(form, '\"deg\"', '5')", "the samples of event .* are damaged"),
        ('UPDATE samples SET form = replace(form, \'"t0_ns":\', \'"t0_ns":"x","t1":\')', "samples .* are damaged"),
        ("UPDATE events SET trial = 'one' WHERE trial = 1", "chain breaks|damaged"),
    ],
)
def test_samples_of_another_shape_are_named(tmp_path, statement, expected):
    path = tmp_path / "x.sqlite"
    shutil.copy(FORMAT_2, path)
    with sqlite3.connect(path) as file:
        file.execute(statement)
    file.close()
    with pytest.raises(LedgerError, match=expected):
        read(path)


def test_collect_names_the_bad_ledger_and_takes_the_others(tmp_path, run_palpate):
    sessions = tmp_path / "sessions"
    sessions.mkdir()
    shutil.copy(FORMAT_1, sessions)
    forged(FORMAT_1, sessions / "doors_small_P099_s1.sqlite", {3: []})
    summary = json.loads(run_palpate("collect", "--lab", tmp_path, "--json", status=1))
    assert (summary["new"], summary["refused"]) == (1, 1)
    assert "doors_small_P099_s1.sqlite: event 3" in summary["problems"][0]
    assert "doors_small_P099_s1.sqlite: event 3 (" in run_palpate("replay", "--lab", tmp_path, status=1)
    bad = sessions / "doors_small_P099_s1.sqlite"
    assert f"{bad}: event 3 (" in run_palpate("streams", bad, status=2)
    assert demographics(tmp_path).refused[0].startswith(f"{bad}: event 3 (")


SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()
JSON = st.recursive(SCALARS, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=6)


@st.composite
def changed(draw, value):
    """The value with one place in it, at any depth, exchanged for something else, removed or added."""
    if isinstance(value, dict) and value and draw(st.integers(0, 4)):
        name = draw(st.sampled_from(sorted(value)))
        if draw(st.integers(0, 5)) == 0:
            return {key: inner for key, inner in value.items() if key != name}
        return {**value, name: draw(changed(value[name]))}
    if isinstance(value, list) and value and draw(st.integers(0, 4)):
        place = draw(st.integers(0, len(value) - 1))
        return [*value[:place], draw(changed(value[place])), *value[place + 1 :]]
    return draw(JSON)


@pytest.mark.untraced
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
@given(st.data())
def test_whatever_a_body_holds_no_reader_fails_without_a_name(tmp_path_factory, data):
    source = data.draw(st.sampled_from(SOURCES))
    events = recorded(source).events
    by_kind = {kind: [e for e in events if e.kind == kind] for kind in {event.kind for event in events}}
    event: Event = data.draw(st.sampled_from(by_kind[data.draw(st.sampled_from(sorted(by_kind)))]))
    try:
        body = canonical(data.draw(changed(event.value)))
    except ValueError:
        return  # half a character has no text: no file holds it
    path = forged(source, tmp_path_factory.getbasetemp() / source.name, {event.seq: body})
    engine = open_database("sqlite://")
    for act in (
        lambda: list(collect([path], engine)),
        lambda: [streams_in(attempt) for attempt in counting_attempts(attempts_of(read(path))).values()],
        lambda: replay(path),
        lambda: follow(path),
    ):
        try:
            act()
        except (LedgerError, CollectError, Divergence, StreamError) as error:
            assert str(error)
    engine.dispose()
