"""The dialogue with the door simulator, step by step; each step waits for its answer."""

from __future__ import annotations

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.codes import CHUNK_POINTS, VERSION, DoorFault, Reason, State, fault_name, state_name
from palpate.devices.door.link.link import Link, Refused

BOOTS_S = 5.0
"""Seconds that a device has to become safe after it was switched on."""
LOOK_AGAIN_S = 0.1


def greet(link: Link) -> says.Identity:
    """Request the device's identity, which also makes it safe whatever it was doing; a latched fault stays.

    Raises:
        DeviceError: no answer, another device, or another version of the protocol.
        DeviceFault: the device does not become safe, or the line is lost.
    """
    identity = _who(link)
    until_s = link.clock_s() + BOOTS_S
    while identity.state == State.boot and link.clock_s() < until_s:
        link.wait(lambda: False, LOOK_AGAIN_S)
        identity = _who(link)
    if identity.state != State.safe:
        link.ask(says.Stop())
        identity = _who(link)
    if identity.state != State.safe:
        message = f"{link.name}: the door stays {state_name(identity.state)} when it is stopped; switch it off and on"
        raise DeviceFault(link.name, "firmware", message)
    return identity


def upload(link: Link, profile: says.Profile) -> None:
    """Send the profile; the device checks it against its own limits. Raises DeviceFault."""
    torque, step = profile.torque_Nm, CHUNK_POINTS
    link.ask(says.UploadBegin(len(torque), profile.end_deg, profile.crc))
    link.ask(*(says.UploadChunk(first, torque[first : first + step]) for first in range(0, len(torque), step)))
    link.ask(says.UploadEnd(profile.crc))


def verify(link: Link, profile: says.Profile) -> None:
    """Read the profile back and compare every point. Raises DeviceFault (firmware) if any differs."""
    differ = differing(profile, read_back(link, len(profile.torque_Nm)))
    if differ:
        message = (
            f"{link.name}: {differ} of the {len(profile.torque_Nm)} points that were read back differ from those sent"
        )
        raise DeviceFault(link.name, "firmware", message)


def read_back(link: Link, points: int) -> dict[int, float]:
    """Return the profile that the device holds, point by point. Raises DeviceFault."""
    step = CHUNK_POINTS
    requests = (says.ReadBack(first, min(step, points - first)) for first in range(0, points, step))
    parts = [part for part in link.ask(*requests) if isinstance(part, says.Part)]
    return {part.first + index: torque for part in parts for index, torque in enumerate(part.torque_Nm)}


def differing(profile: says.Profile, held: dict[int, float]) -> int:
    """Return how many points differ from those sent, counting missing ones."""
    return sum(held.get(index) != torque for index, torque in enumerate(profile.torque_Nm))


def play(link: Link, profile: says.Profile) -> None:
    """Arm with this very profile, and play it; from then on heartbeats must be sent. Raises DeviceFault."""
    link.keep_alive()
    link.ask(says.Arm(profile.crc))
    link.keep_alive()
    link.ask(says.Play())
    link.from_now()


def change(link: Link, profile: says.Profile) -> str:
    """Change to this profile while it plays; return "", or why the door keeps its profile.

    Raises DeviceFault if the line is lost.
    """
    try:
        upload(link, profile)
        link.ask(says.Change(profile.crc))
    except Refused as refused:
        return str(refused)
    return ""


def clear(link: Link, fault: int) -> bool:
    """Clear the latched fault; return False if its cause remains. Raises DeviceFault for any other refusal."""
    try:
        link.ask(says.Clear(fault))
    except Refused as refused:
        if refused.nak.reason == Reason.cause_remains:
            return False
        raise
    return True


def rest(link: Link) -> None:
    """Stop the door as well as possible: a device that does not hear goes safe because the heartbeats stop too."""
    link.keep_alive(0)
    if link.broken is None:
        try:
            link.ask(says.Stop())
        except DeviceFault:
            link.send(says.Stop())


def _who(link: Link) -> says.Identity:
    known = link.received
    try:
        (answer,) = link.ask(says.Hello())
    except Refused as refused:
        raise DeviceError(
            _other_version(link) if refused.nak.reason == Reason.wrong_version else str(refused)
        ) from None
    except DeviceFault as fault:
        raise DeviceError(_nobody(link, fault, link.received - known)) from fault
    if not isinstance(answer, says.Identity) or not answer.known:
        raise DeviceError(f"{link.name}: what answers is not a door simulator. Is this its port?")
    if answer.version != VERSION:
        raise DeviceError(_other_version(link))
    return answer


def _other_version(link: Link) -> str:
    return (
        f"{link.name}: the door simulator speaks another version of the protocol; this program speaks {VERSION}. "
        "Bring its firmware, or this program, up to date."
    )


def _nobody(link: Link, fault: DeviceFault, foreign: int) -> str:
    if foreign:
        return (
            f"{link.name}: something answers ({foreign} bytes that are not a message of a door simulator). Is this its "
            "port, and its baud rate?"
        )
    return f"{link.name}: no door simulator answers. Is it switched on, and is this its port? ({fault})"


WORD_AND_MESSAGE = {
    DoorFault.heartbeat_lost: ("heartbeat_lost", "it heard nothing of this computer for too long (heartbeat lost)"),
    DoorFault.sensor_silent: ("silent", "a sensor of it is silent"),
    DoorFault.encoder_stuck: ("stuck", "its encoder is stuck"),
    DoorFault.not_a_number: ("not_a_number", "a sensor of it gave no number"),
    DoorFault.over_range: ("over_range", "a sensor of it gave a value that cannot be"),
    DoorFault.over_speed: ("limit", "the arm moved faster than is allowed"),
    DoorFault.emergency_stop: ("emergency_stop", "the emergency stop was pressed"),
    DoorFault.profile_damaged: ("firmware", "its memory of the profile was damaged"),
}
"""For every fault of the device: its category, and the message for people."""


def latched_fault(name: str, fault: int) -> DeviceFault:
    """Return the device's own fault as a DeviceFault."""
    known = WORD_AND_MESSAGE.get(DoorFault(fault)) if fault in set(DoorFault) else None
    what, message = known or ("firmware", f"it reported {fault_name(fault)}, which this version does not know")
    return DeviceFault(name, what, f"{name}: the door went safe: {message}")
