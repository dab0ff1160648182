"""Scripts: which need shaping, and which packages bring fonts for them."""

from __future__ import annotations

from collections.abc import Sequence

COMPLEX = (
    (0x0590, 0x08FF),
    (0x0900, 0x0DFF),
    (0x0E00, 0x0FFF),
    (0x1000, 0x109F),
    (0x1100, 0x11FF),
    (0x1780, 0x17FF),
    (0xA8E0, 0xA8FF),
    (0xFB1D, 0xFDFF),
    (0xFE70, 0xFEFC),
)
"""Hebrew to Arabic, the scripts of India, Thai to Tibetan, Myanmar, loose Hangul letters, Khmer, and extensions."""
_CJK = ("fonts-noto-cjk", "the system's Korean, Japanese or Chinese language pack")
SOURCES = (
    (0x1100, 0x11FF, *_CJK),
    (0x3000, 0x9FFF, *_CJK),
    (0xA960, 0xD7FF, *_CJK),
    (0xF900, 0xFAFF, *_CJK),
    (0xFF00, 0xFFEF, *_CJK),
    (0x20000, 0x3FFFF, "fonts-noto-cjk", "the system's Chinese language pack"),
    (0x0900, 0x0DFF, "fonts-noto-core", "the system's Hindi or Indian language pack (Nirmala UI, Kohinoor)"),
    (0x1F000, 0x1FAFF, "fonts-symbola", "or leave pictures such as these out of the text"),
)
ANY = ("fonts-noto-core or fonts-noto-extra", "Noto Sans from notofonts.github.io")


def is_complex(character: str) -> bool:
    """Whether the script joins or reorders letters, so that one glyph after another would be wrong."""
    return any(first <= ord(character) <= last for first, last in COMPLEX)


def packages_for(characters: Sequence[str]) -> str:
    """What to install for characters that no font has: Debian's packages, and what other systems call it."""
    found: dict[tuple[str, str], None] = {}
    for character in characters:
        rows = ((debian, other) for first, last, debian, other in SOURCES if first <= ord(character) <= last)
        found[next(rows, ANY)] = None
    return " and ".join(f"{debian} (Debian, Ubuntu) / {other} (Windows, macOS)" for debian, other in found)
