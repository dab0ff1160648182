"""Figures of the serial link: an upload, reading telemetry, the cost of garbage, and how soon the door is safe."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping
from functools import partial

from benchmarks.serial_drills import DRILLS, Drilled, run_drill
from benchmarks.serial_lines import PacedLine
from palpate.devices.door.firmware.controller import Firmware
from palpate.devices.door.firmware.twin_plant import TwinPlant
from palpate.devices.door.firmware.wire import Wire
from palpate.devices.door.link import dialogue
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.connections import by_twin
from palpate.devices.door.link.frames import Frame, Parser, on_the_line
from palpate.devices.door.link.limits import Limits
from palpate.devices.door.link.link import Link
from palpate.devices.door.twin import open_door
from palpate.protocols.bench import Case

BAUD = 1_000_000
AREA = "serial"
Call = Callable[[], object]
WAYS: Mapping[str, Callable[[Drilled], float]] = {
    "motor off, brake switched on": lambda drill: float(drill.off_ms),
    "motor below 1 % of what it gave": lambda drill: float(drill.without_motor_ms),
    "brake current at 90 %": lambda drill: float(drill.braked_ms),
}


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of upload and verify, parsing, resynchronising, and the way to safe."""
    yield from _uploads(5 if quick else 15)
    yield from _parsing(5_000 if quick else 50_000)
    yield from _resynchronising(200 if quick else 2_000)
    yield from _drills()


def _profile() -> says.Profile:
    """Return a profile without equal points, so that a point in a wrong place is detected."""
    return says.Profile(tuple(20 + 0.05 * index for index in range(621)), 62.0)


def _uploads(repeats: int) -> Iterator[Case]:
    link = _linked(1)
    yield _upload("in this process, 1 Mbaud, read back", link, repeats, verify=True)
    yield _upload("in this process, 1 Mbaud, not read back", link, repeats, verify=False)
    yield _upload("through a USB adapter of 16 ms latency, read back", _linked(16), repeats, verify=True)
    connection = by_twin("door", 1.0, 1, Limits(), BAUD)
    try:
        dialogue.greet(connection.link)
        yield _upload("a process behind a pty, 1 Mbaud, read back", connection.link, repeats, verify=True)
    finally:
        connection.close()


def _upload(method: str, link: Link, repeats: int, verify: bool) -> Case:
    profile = _profile()

    def run() -> dict[int, float]:
        dialogue.upload(link, profile)
        return dialogue.read_back(link, len(profile.torque_Nm)) if verify else {}

    def error(read_back: dict[int, float]) -> float:
        return float(dialogue.differing(profile, read_back or dialogue.read_back(link, len(profile.torque_Nm))))

    input_name = "621 points, telemetry at 500 Hz meanwhile"
    return Case(AREA, "upload a profile", method, input_name, 621, "points that differ", run, error, repeats)


def _linked(latency_ms: int) -> Link:
    link = Link("door", PacedLine(Wire(Firmware(TwinPlant(1)), BAUD), latency_ms))
    dialogue.greet(link)
    return link


def _telemetry(count: int) -> list[says.Telemetry]:
    """Return the telemetry of an opening of the door."""
    opened = open_door([10 + 0.01 * index for index in range(621)], (count - 1) / 1000, 1000)
    rows = zip(opened.angle_deg, opened.force_N, strict=True)
    return [says.Telemetry(1000 * n, n, angle, 1.5, force, 0.2, 3, 0) for n, (angle, force) in enumerate(rows)]


def _parsing(count: int) -> Iterator[Case]:
    sent = _telemetry(count)
    line = b"".join(says.sent(sample, sample.sample & 0xFFFF) for sample in sent)
    input_name = f"{len(line):,} bytes, {count:,} frames"

    def parse(size: int, whole: bool) -> Call:
        def run() -> list[object]:
            parser = Parser()
            pieces = (line[at : at + size] for at in range(0, len(line), size))
            frames = [frame for piece in pieces for frame in parser.feed(piece)]
            return [says.understood(frame) for frame in frames] if whole else list(frames)

        return run

    def lost(received: list[object]) -> float:
        right = sum(a == b for a, b in zip(received, sent, strict=False)) if received[0] == sent[0] else len(received)
        return float(count - right)

    for size in (64, 4096):
        for whole, what in ((False, "frames"), (True, "frames and messages")):
            yield Case(
                AREA, "read telemetry", f"{what}, {size} bytes at a time", input_name, len(line), "frames lost",
                parse(size, whole), lost,
            )  # fmt: skip


def garbage(chance: random.Random) -> bytes:
    """Return up to 4 kB of line noise: random bytes, runs of one byte, noise without an end, parts of frames."""
    length = chance.randrange(1, 4096)
    frame = on_the_line(Frame(chance.randrange(256), chance.randrange(1 << 16), chance.randbytes(200)))
    at = chance.randrange(len(frame))
    kinds = (
        lambda: chance.randbytes(length),
        lambda: bytes([chance.randrange(256)]) * length,
        lambda: bytes(chance.choices(range(1, 256), k=length)),
        lambda: frame[at:] + frame[:at],
        lambda: frame[:at] * chance.randrange(1, 9),
    )
    return chance.choice(kinds)()


def frames_lost(seed: int) -> int:
    """Return how many of 20 frames are lost if garbage falls between them, or within one."""
    chance = random.Random(seed)
    sent = [Frame(says.Telemetry.KIND, number, chance.randbytes(30)) for number in range(20)]
    line = b"".join(map(on_the_line, sent))
    at = chance.randrange(len(line))
    received = Parser().feed(line[:at] + garbage(chance) + line[at:])
    return len(sent) - sum(frame in set(received) for frame in sent)


def _resynchronising(drills: int) -> Iterator[Case]:
    input_name = f"{drills} drills, up to 4 kB of garbage in 20 frames"
    yield Case(
        AREA, "garbage on the line", "worst of all drills", input_name, drills,
        "frames lost", lambda: [frames_lost(seed) for seed in range(drills)], lambda lost: float(max(lost)), 3,
    )  # fmt: skip


def _drills() -> Iterator[Case]:
    """Yield the cases of the door machine's drills; only their errors matter, not their computing time."""
    input_name = "the twin's plant in full swing, 1.6 s into its play"
    for name in DRILLS:
        for what, read in WAYS.items():
            drill = partial(run_drill, name)
            yield Case(AREA, f"safe after: {name}", what, input_name, 1, "ms of plant time", drill, read, 1)
