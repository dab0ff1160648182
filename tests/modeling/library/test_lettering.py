"""Letters on a picture."""

import pytest
from PIL import Image, ImageDraw

from palpate.modeling.library.lettering import MORE, Pen

PEN = Pen(ImageDraw.Draw(Image.new("RGB", (10, 10))))


@pytest.mark.parametrize("room", [0, 5, 20, 77.5, 200])
def test_a_text_is_cut_off_where_there_is_no_room_and_no_sooner(room):
    text = "sandpaper 3 of 5, coarse"
    found = PEN.fitted(text, room, 14, bold=True)
    if found == text:
        assert PEN.width(text, 14, bold=True) <= room
        return
    assert found.endswith(MORE) and text.startswith(found[:-1])
    assert PEN.width(found, 14, bold=True) <= room or found == MORE
    longer = text[: len(found[:-1]) + 2].rstrip() + MORE
    assert PEN.width(longer, 14, bold=True) > room


def test_what_fits_stays():
    assert PEN.fitted("T01", 400, 14) == "T01" and PEN.fitted("", 0, 14) == ""
