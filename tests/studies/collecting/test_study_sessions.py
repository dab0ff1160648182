"""Sessions that may be used: not of who withdrew, in their order, and real or simulated ones but never both."""

from dataclasses import dataclass

import pytest

from palpate.studies.collecting.study_sessions import headers_of, real_or_simulated, sessions_of
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.withdrawal import withdraw
from palpate.studies.sessions.ledger import create
from palpate.studies.sessions.record import LedgerError, read
from tests.analysis.streams.ledgers import DOOR

AT = {"at": "2026-01-01T00:00:00+00:00"}


@pytest.fixture
def lab(tmp_path):
    header = read(DOOR).header
    (tmp_path / "sessions").mkdir()
    for participant in ("P001", "P002"):
        path = tmp_path / "sessions" / f"door_capture_{participant}_s1.sqlite"
        create(path, {**header, "participant": participant}, AT)
    return tmp_path


def test_a_session_of_somebody_who_withdrew_is_not_read_past_its_first_event(lab):
    assert [record.header["participant"] for record in sessions_of(lab, "door_capture")] == ["P001", "P002"]
    registry = open_registry(lab)
    for participant in ("P001", "P002"):
        enter(registry, participant)
    withdraw(registry, "P001", "asked to")
    assert [record.header["participant"] for record in sessions_of(lab, "door_capture")] == ["P002"]
    assert list(sessions_of(lab / "sessions" / "door_capture_P001_s1.sqlite", "door_capture")) == []


def test_a_damaged_file_has_no_header_and_is_no_session(lab):
    path = lab / "sessions" / "door_capture_P001_s1.sqlite"
    path.write_bytes(path.read_bytes()[:100])
    assert [header is None for _, header in headers_of(lab, "door_capture")] == [True, False]
    with pytest.raises(LedgerError, match="P001"):
        list(sessions_of(lab, "door_capture"))


@dataclass
class Capture:
    simulated: bool


REAL, TWIN = Capture(False), Capture(True)
NOTE = "captures of {} sessions are left out: they are not mixed with others"


@pytest.mark.parametrize(
    ("items", "simulated", "chosen", "left_out"),
    [
        ([REAL, TWIN, REAL], None, [REAL, REAL], "simulated"),
        ([REAL, TWIN], True, [TWIN], "real"),
        ([TWIN, TWIN], None, [TWIN, TWIN], None),
        ([REAL], None, [REAL], None),
        ([TWIN], False, [], "simulated"),
        ([], None, [], None),
    ],
)
def test_real_ones_are_taken_where_there_are_any_unless_one_kind_is_chosen(items, simulated, chosen, left_out):
    notes = () if left_out is None else (NOTE.format(left_out),)
    assert real_or_simulated(items, simulated, "captures") == (chosen, notes)
