"""docs/reference/door-protocol.md says what the code does."""

import re
from itertools import takewhile
from pathlib import Path

import pytest

from palpate import devices
from palpate.devices.door.firmware.controller import ALLOWED, BOOT_MS, REMEMBERED
from palpate.devices.door.firmware.sensor_check import PULLED_NM, SILENT_MS, STANDS_DEG, STUCK_DEG_S, STUCK_MS, Limits
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.codes import CHUNK_POINTS, HEARTBEAT_MS, DoorFault, Reason, State
from palpate.devices.door.link.frames import MAX_PAYLOAD, Frame, bare
from palpate.devices.door.link.link import ALIVE_S, REPLY_S

PAGE = (Path(devices.__file__).resolve().parent.parent / "docs/reference/door-protocol.md").read_text(encoding="utf-8")
NAMES = {"H": "u16", "I": "u32", "B": "u8", "f": "f32", "Q": "u64", "4s": "4 bytes"}
EXAMPLES = [(says.Hello(), 1), (says.Telemetry(1_500_000, 750, 12.5, -3.25, 8.0, 0.25, State.playing, 0), 750)]


def rows(header):
    """The rows of the table that begins with this header, as lists of cells."""
    lines = PAGE.split(f"| {header} |", 1)[1].splitlines()[2:]
    table = takewhile(bool, lines)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table]


@pytest.mark.parametrize(("message", "sequence"), EXAMPLES)
def test_the_worked_examples_are_what_is_sent(message, sequence):
    frame = Frame(message.KIND, sequence, message.pack())
    for label, data in (("payload", frame.payload), ("frame", bare(frame)), ("line", says.sent(message, sequence))):
        assert f"{label:<10}{data.hex(' ')}\n" in PAGE


def payload(kind):
    """The payload as the page writes it."""
    names = [name for name, field in kind.__dataclass_fields__.items() if "ClassVar" not in str(field.type)]
    codes = re.findall(r"4s|[A-Za-z]", kind.LAYOUT.format)
    described = [f"{name} {NAMES[code]}" for name, code in zip(names, codes, strict=False)]
    return ", ".join([*described, "torque_Nm f32 ..."] if issubclass(kind, says.Points) else described)


def test_every_message_is_there_with_its_payload():
    documented = {row[0]: (row[1], row[3]) for row in rows("type | message | from | payload | answered by")}
    assert documented == {f"{kind.KIND:#04x}": (kind.__name__, payload(kind)) for kind in says.MESSAGES}


def test_where_a_request_may_be_made():
    documented = {row[0]: row[1:5] for row in rows("request | boot | safe | armed | playing | then")}
    assert documented == {
        kind.__name__: ["yes" if state in states else "no" for state in State] for kind, states in ALLOWED.items()
    }


def test_codes():
    for header, codes in (
        ("code | state | motor | brake | what it is", State),
        ("code | fault | found | while", DoorFault),
        ("code | reason of a Nak", Reason),
    ):
        assert [(int(row[0]), row[1]) for row in rows(header)] == [(code.value, code.name) for code in codes]


def test_numbers():
    limits = Limits()
    for number_text in (
        f"no Heartbeat for more than {HEARTBEAT_MS} ms", f"no new reading for {SILENT_MS} ms",
        f"stands for {STUCK_MS} ms (within {STANDS_DEG:g} deg) though the arm came at {STUCK_DEG_S:g} deg/s",
        f"pulls {PULLED_NM:g} N m more", f"at most {MAX_PAYLOAD}", f"at most {CHUNK_POINTS}\n  points",
        f"last {REMEMBERED})", f"within {REPLY_S:g} s", f"within {ALIVE_S:g} s", f"by itself after {BOOT_MS} ms",
        f"angle outside {limits.angle_deg[0]:g} to {limits.angle_deg[1]:g} deg, torque beyond {limits.sensed_Nm[1]:g}",
        f"faster than {limits.still_deg_s:g} deg/s",
    ):  # fmt: skip
        assert number_text in PAGE, number_text
