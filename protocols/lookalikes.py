"""Labels that a reader takes for one and a program for two: "01" and "1", "P001" and "p1", two ways to write "é"."""

from __future__ import annotations

import re
import unicodedata

_NUMBER = re.compile(r"[+-]?[0-9]+(?:[.,][0-9]+)?")


def looks(label: str) -> str:
    """The same text for labels that look alike: one way for each letter, no case, no outer or doubled blanks."""
    text = " ".join(unicodedata.normalize("NFKC", label).casefold().split())
    if _NUMBER.fullmatch(text):
        whole, _, fraction = text.replace(",", ".").lstrip("+").partition(".")
        text = f"{whole}.{fraction.rstrip('0')}".rstrip(".")
    return re.sub(r"(?<![0-9.])0+(?=[0-9])", "", text)
