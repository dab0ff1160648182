import struct
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.devices.window.fonts import (
    Face,
    Fonts,
    NotAFont,
    coverage,
    find_fonts,
    font_files,
    in_order,
    system_folders,
)
from palpate.devices.window.geometry import WindowError
from tests.devices.window.screens.pages import fonts

MATPLOTLIB = system_folders()[-1]


def latin_only():
    return find_fonts(folders=[MATPLOTLIB])


def test_latin_with_accents_can_always_be_drawn_by_the_font_that_matplotlib_brings():
    latin_only().demand(["Äußerst ça déjà Łódź ñ ő – “quoted” … ← → ↓"])


@pytest.mark.needs("fonts")
def test_characters_without_a_font_are_named_with_what_to_install():
    with pytest.raises(WindowError) as error:
        latin_only().demand(["Rough", "거친", "कड़ा"])
    message = str(error.value)
    assert "HANGUL SYLLABLE GEO" in message and "DEVANAGARI LETTER KA" in message
    assert "fonts-noto-cjk (Debian" in message and "fonts-noto-core (Debian" in message and "Nirmala UI" in message


@pytest.mark.needs("fonts")
def test_korean_hindi_and_accents_are_covered_here():
    fonts().demand(["거칠다 매끄럽다", "खुरदुरा क्षण स्निग्ध", "Ærøskøbing, naïve, tiếng Việt"])


@pytest.mark.needs("fonts")
def test_a_line_of_many_scripts_is_split_by_font_and_marks_stay_with_their_letter():
    runs = fonts().runs("Rough 거친 कि é!")
    assert [run.text for run in runs] == ["Rough ", "거친 ", "कि ", "é!"]
    assert len({run.face for run in runs}) == 3


def test_bold_falls_back_to_regular_where_a_bold_font_lacks_the_character():
    mixed = Fonts(fonts().regular, latin_only().bold)
    assert mixed.face("a", bold=True).path.name == "DejaVuSans-Bold.ttf"
    assert mixed.face("거", bold=True) == mixed.face("거")


@pytest.mark.needs("fonts")
def test_complex_scripts_are_refused_where_pillow_cannot_shape_them():
    plain = Fonts(fonts().regular, shapes_complex=False)
    plain.demand(["Rough 거친"])
    with pytest.raises(WindowError, match="Raqm.*DEVANAGARI LETTER KA"):
        plain.demand(["कड़ा"])


@pytest.mark.needs("fonts")
def test_hindi_is_shaped_and_not_drawn_letter_by_letter():
    font = fonts().font(fonts().face("क"), 40)
    assert font.getlength("क्षि") < sum(font.getlength(letter) for letter in "क्षि")


def test_joiners_and_line_breaks_need_no_font():
    latin_only().demand(["a\u200db\n\u00adc"])


def test_the_character_map_agrees_with_fonttools():
    from fontTools import ttLib as fonttools

    for face in fonts().regular[:12]:
        known = set(fonttools.TTFont(face.path, fontNumber=face.index).getBestCmap())
        codes = coverage(face.path, face.index)
        ranges = zip(codes.first, codes.last, strict=True)
        assert {code for first, last in ranges for code in range(first, last + 1)} - {0xFFFF} == known - {0xFFFF}


@pytest.mark.parametrize("content", [b"", b"no font at all, only text", b"ttcf" + bytes(8), b"\0\1\0\0" + bytes(60)])
def test_a_broken_font_file_is_passed_over(tmp_path, content):
    broken = tmp_path / "NotoSans-Regular.ttf"
    broken.write_bytes(content)
    with pytest.raises(NotAFont):
        coverage(broken)
    faces = find_fonts(folders=[tmp_path, MATPLOTLIB])
    assert faces.regular[0].path == broken and faces.face("a").path.name == "DejaVuSans.ttf"


def test_a_map_that_points_beyond_its_end_is_broken(tmp_path):
    file = tmp_path / "x.ttf"
    table = struct.pack(">HHHHI", 0, 1, 3, 1, 12) + struct.pack(">HHHH", 4, 16, 0, 60)
    header = b"\0\1\0\0" + struct.pack(">HHHH", 1, 0, 0, 0) + struct.pack(">4sIII", b"cmap", 0, 28, len(table))
    file.write_bytes(header + table)
    with pytest.raises(NotAFont, match="broken"):
        coverage(file)


def test_no_font_at_all_is_refused(tmp_path):
    with pytest.raises(WindowError, match="no font was found"):
        find_fonts(folders=[tmp_path])


def test_an_own_folder_comes_first_and_preference_goes_by_name(tmp_path):
    (tmp_path / "DejaVuSans.ttf").write_bytes((MATPLOTLIB / "DejaVuSans.ttf").read_bytes())
    files = font_files([tmp_path, MATPLOTLIB])
    assert files["DejaVuSans.ttf"].parent == tmp_path
    assert [path.name for path in in_order(files, ("NotoSans*", "DejaVuSans.ttf", "DejaVuSans*.ttf"))][:2] == [
        "DejaVuSans.ttf", "DejaVuSans-Bold.ttf",
    ]  # fmt: skip


def test_every_platform_has_folders_to_look_in(monkeypatch):
    monkeypatch.setenv("WINDIR", "C:/Windows")
    assert Path("C:/Windows/Fonts") in system_folders("win32")
    assert Path("/System/Library/Fonts") in system_folders("darwin")
    assert Path("/usr/share/fonts") in system_folders("linux")


@pytest.mark.needs("fonts")
def test_chinese_characters_are_written_as_the_language_knows_them():
    faces = {language: find_fonts(language).face("直") for language in ("ko", "ja")}
    assert faces["ko"] == Face(faces["ko"].path, 1) and faces["ja"] == Face(faces["ja"].path, 0)


def test_looking_for_fonts_imports_neither_matplotlib_nor_numpy():
    code = (
        "import sys; from palpate.devices.window.fonts import find_fonts; find_fonts().width('a', 20); "
        "print([*sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"'matplotlib'", "'numpy'", "'psychopy'", "'pyglet'"} & set(done.stdout.strip("[]\n").split(", "))
