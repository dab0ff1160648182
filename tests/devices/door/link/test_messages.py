from dataclasses import fields

import pytest

from palpate.devices.door.link import messages as says
from palpate.devices.door.link.frames import Frame, Parser

SAMPLES = {
    says.Identity: says.Identity(b"PDOR", 1, 2, 77, 621, 60.0, 100.0, 180.0, 40, 1, 0, 0xFFFFFFFF),
    says.UploadChunk: says.UploadChunk(620, (1.5,)),
    says.Part: says.Part(0, tuple(map(float, range(128)))),
}


@pytest.mark.parametrize("kind", says.MESSAGES)
def test_every_message_comes_back_from_the_line(kind):
    numbers = range(1, len(fields(kind)) + 1)
    message = SAMPLES.get(kind) or kind(*numbers)
    (frame,) = Parser().feed(says.sent(message, 65535))
    assert frame.sequence == 65535 and says.understood(frame) == message


def test_types_are_distinct():
    assert len({kind.KIND for kind in says.MESSAGES}) == len(says.MESSAGES)


@pytest.mark.parametrize("kind", says.MESSAGES)
def test_a_payload_of_another_length_is_not_understood(kind):
    payload = (SAMPLES.get(kind) or kind(*range(1, len(fields(kind)) + 1))).pack()
    assert says.understood(Frame(kind.KIND, 1, payload + b"\0")) is None


def test_the_crc_of_a_profile_is_of_every_point_and_of_its_end():
    whole = says.Profile((1.0,) * 621, 60.0)
    assert whole.crc != says.Profile((1.0,) * 621, 59.9).crc
    assert whole.crc != says.Profile((1.0,) * 620 + (1.001,), 60.0).crc


def test_a_profile_holds_what_the_line_carries():
    held = says.Profile((0.1,) * 621, 60.1)
    assert held.torque_Nm[0] != 0.1 and held.torque_Nm[0] == pytest.approx(0.1, rel=1e-7)
    assert held == says.Profile(held.torque_Nm, held.end_deg)
