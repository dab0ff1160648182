"""Labels that look the same to a reader but not to a program: "01" and "1", "P001" and "p1", two forms of "é"."""

from __future__ import annotations

import re
import unicodedata

_NUMBER = re.compile(r"[+-]?[0-9]+(?:[.,][0-9]+)?")


def looks(label: str) -> str:
    """Return the same text for labels that look alike: Unicode normalised, no case, no outer or repeated spaces."""
    text = " ".join(unicodedata.normalize("NFKC", label).casefold().split())
    if _NUMBER.fullmatch(text):
        whole, _, fraction = text.replace(",", ".").lstrip("+").partition(".")
        text = f"{whole}.{fraction.rstrip('0')}".rstrip(".")
    return re.sub(r"(?<![0-9.])0+(?=[0-9])", "", text)
