"""Numbers in foreign tables, with points or commas; ambiguous ones are refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import isfinite
from typing import Literal

Decimal = Literal[".", ","]

_INTEGER = re.compile(r"[+-]?[0-9]+(?:[eE][+-]?[0-9]+)?")
_FRACTION = {
    mark: re.compile(rf"[+-]?(?:[0-9]+{re.escape(mark)}[0-9]*|{re.escape(mark)}[0-9]+)(?:[eE][+-]?[0-9]+)?")
    for mark in ".,"
}
_ONE_GROUP = {mark: re.compile(rf"[+-]?[1-9][0-9]{{0,2}}{re.escape(mark)}[0-9]{{3}}") for mark in ".,"}
_GROUPED = re.compile(r"[+-]?[0-9]{1,3}(?:([.,'’_\s\u00a0\u202f])[0-9]{3})(?:\1[0-9]{3})*(?:[.,][0-9]+)?")
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
_ZERO = re.compile(r"[+-]?[0.,]*(?:[eE][+-]?[0-9]+)?")

_MONTH = "jan|feb|m[aä]r|mrz|apr|ma[iy]|jun|jul|aug|sep|o[ck]t|nov|de[cz]|[0-9]+월"
_DATE = "a date, which spreadsheets make of numbers as 4.3; set the column's format to text there and enter it again"
_OTHER_FORMS = (
    (
        re.compile(r"[\u2010-\u2015\u2212][0-9.,]+"),
        "written with another minus sign; write -, the hyphen of the keyboard",
    ),
    (re.compile(r"=.+"), "a formula; save the table with the formula's value in its place"),
    (
        re.compile(r"#[A-Z0-9/!?]+!?"),
        "a spreadsheet's formula error; correct it there or, only if nothing was rated, list the text under missing",
    ),
    (re.compile(r"[0-9]{1,3}:[0-9]{2}(?::[0-9]{2})?(?:[.,][0-9]+)?"), "a time; write it as a number of one unit"),
    (re.compile(r"[<>≤≥~≈=]+\s*[0-9.,]+|[0-9.,]+\s*[?+]"), "a bound or a guess; write the number that counts, alone"),
    (re.compile(r"[$€£¥₩]\s*[0-9.,]+|[0-9.,]+\s*[$€£¥₩°]"), "a number with a unit; write the number alone"),
    (
        re.compile(r"[0-9]*\s*[¼-¾⅐-⅞]|[0-9]+\s*/\s*[0-9]+"),
        "a fraction, or a date that a spreadsheet turned it into; write a decimal number",
    ),
    (re.compile(r"[0-9.,]+\s*[-–—]\s*[0-9.,]+"), "a range; write the number that counts, alone"),
    (re.compile(r"true|false|yes|no", re.I), "a word for yes or no; write the numbers that stand for them, as 1 and 0"),
    (re.compile(r"[+-]?0x[0-9a-f]+", re.I), "a hexadecimal number; write it with the digits 0 to 9"),
    (re.compile(r"[+-]?[0-9.,]+\s*[%‰]"), "a percentage; write the numbers without the sign, in the scale's units"),
    (
        re.compile(rf"(?=.*[0-9])(?:[0-9]{{1,4}}[./\s-]*)?(?:{_MONTH})[a-z]*\.?(?:[./\s-]*[0-9]{{1,4}}일?)?", re.I),
        _DATE,
    ),
    (re.compile(r"[0-9]{1,4}([./-])[0-9]{1,2}\1[0-9]{1,4}"), _DATE),
    (re.compile(r"(?=.*[^\x00-\x7f])[+-]?[\d.,٫٬]+"), "written with digits of another script; write 0 to 9"),
    (re.compile(r"[+-]?[0-9.,]+\s*[^\W\d_]+(?:/[^\W\d_]+)?"), "a number with a unit; write the number alone"),
)
_NO_NUMBER = "no number; correct the cell or, only if nothing was rated there, list the text under missing"


class NoNumber(ValueError):
    """The text is no finite number in the table's format; the message says why."""


def decimal_mark(texts: Sequence[str], delimiter: str) -> Decimal:
    """Return the decimal mark of these texts, '.' if none has a fraction.

    1.234 is ambiguous, except in a table that separates its columns by commas, where the point is a decimal mark.
    Raises NoNumber where the texts disagree or remain ambiguous.
    """
    points = [text for text in texts if _FRACTION["."].fullmatch(text)]
    commas = [text for text in texts if _FRACTION[","].fullmatch(text)]
    if points and commas:
        raise NoNumber(f"{points[0]!r} and {commas[0]!r} are in one column; say decimal: '.' or ','")
    if commas:
        return _decided(",", commas)
    if points and delimiter != ",":
        return _decided(".", points)
    return "."


def _decided(mark: Decimal, texts: Sequence[str]) -> Decimal:
    if all(_ONE_GROUP[mark].fullmatch(text) for text in texts):
        raise NoNumber(f"{texts[0]!r} can be a thousand or a fraction; say decimal: '.' or ','")
    return mark


def number(text: str, decimal: Decimal) -> float:
    """Return the number in a text with this decimal mark. Raises NoNumber on anything else."""
    if not (_INTEGER.fullmatch(text) or _FRACTION[decimal].fullmatch(text)):
        raise NoNumber(_why_not(text, decimal))
    value = float(text.replace(",", "."))
    if not isfinite(value):
        raise NoNumber("too large for a number of 64 bits")
    if value == 0 and not _ZERO.fullmatch(text):
        raise NoNumber("too small for a number of 64 bits")
    return value


def _why_not(text: str, decimal: Decimal) -> str:
    other = "," if decimal == "." else "."
    if not text.strip():
        return "the cell is empty; if that means a missing rating, list it under missing"
    if text != text.strip():
        return "blanks around it; say trim: true"
    if _NOT_FINITE.fullmatch(text):
        return "not finite; if it means a missing rating, list it under missing"
    if _FRACTION[other].fullmatch(text):
        return f"written with {other!r} where the decimal mark is {decimal!r}"
    if _GROUPED.fullmatch(text):
        return "written with thousands separators; write it without"
    return next((advice for form, advice in _OTHER_FORMS if form.fullmatch(text)), _NO_NUMBER)
