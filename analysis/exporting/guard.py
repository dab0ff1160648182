"""Refusal of identifying data, by the name of a column or the content of a cell, with file, column and row."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

from palpate.analysis.exporting.tabular import ExportRefused, Row, Table, cell_text
from palpate.studies.participants.identities import Identity
from palpate.studies.participants.sidecar import identifying

IDENTIFYING_WORDS = frozenset(
    word
    for line in (
        "ip ipaddress ipv4 ipv6 mac macaddress hostname username login userid studentid matriculation account",
        "latitude longitude gps geolocation website homepage instagram twitter whatsapp wechat insurance",
        "vorname nachname geburtsdatum geburtstag geburtsjahr telefon telefonnummer anschrift adresse wohnort plz",
        "postleitzahl matrikelnummer unterschrift",
        "nom prenom prénom courriel naissance téléphone adresse",
        "nombre apellido apellidos correo teléfono telefono dirección direccion nacimiento",
        "nome cognome indirizzo nascita codicefiscale sobrenome endereço endereco nascimento",
        "naam voornaam achternaam adres geboortedatum namn adress födelsedatum",
        "имя фамилия телефон адрес почта",
        "姓名 名字 电话 電話 手机 邮箱 地址 住址 生日 出生日期 身份证 微信",
        "氏名 名前 住所 生年月日 メール 電話番号",
        "नाम पता फ़ोन ईमेल जन्मतिथि",
    )
    for word in line.split()
)
"""Words in more languages than those that participants.json may not contain (studies/participants/sidecar.py)."""
_MONTH = r"(?:jan|feb|mar|mär|maer|apr|may|mai|jun|jul|aug|sep|oct|okt|nov|dec|dez)[a-zä]*\.?"
_DAY, _IN_YEAR, _YEAR = r"(?:0?[1-9]|[12]\d|3[01])", r"(?:0?[1-9]|1[0-2])", r"(?:(?:19|20)\d\d|\d\d)"
IDENTIFYING_PATTERNS: Mapping[str, re.Pattern[str]] = {
    "an e-mail address": re.compile(
        r"[^\s@,;<>()]+(?:@|\s*[\[(]\s*at\s*[\])]\s*)[^\s@]+?(?:\.|\s*[\[(]dot[\])]\s*)\w{2,}"
    ),
    "an IP address": re.compile(
        r"(?<![\w.])(?:\d{1,3}\.){3}\d{1,3}(?![\w.])|(?<!\w)(?:[0-9a-f]{1,4}:){4,7}[0-9a-f]{1,4}"
    ),
    "a web address": re.compile(r"https?://|(?<!\w)www\.\w"),
    "a date, as of birth": re.compile(
        rf"(?<!\d)(?:19|20)\d\d\s?[-./]\s?{_IN_YEAR}\s?[-./]\s?{_DAY}(?!\d)"
        rf"|(?<!\d){_DAY}\s?[-./]\s?{_DAY}\s?[-./]\s?{_YEAR}(?!\d)"
        rf"|\d{{2,4}}\s?[年년]\s?\d{{1,2}}\s?[月월]"
        rf"|(?<!\d){_DAY}(?:st|nd|rd|th)?\.?\s{_MONTH},?\s{_YEAR}(?!\d)|(?<!\w){_MONTH}\s{_DAY}(?:st|nd|rd|th)?,?\s{_YEAR}(?!\d)"
    ),
}  # fmt: skip
_DIGITS = re.compile(r"(?<![\w.,])[+(]?\d(?:[\d\s().\-/]*\d)?(?![\w])")
_FEWEST, _MOST = 8, 16
REDACTED = "[redacted]"


@dataclass(frozen=True)
class Guard:
    """A check for identifying data; `people` are those whose names and contacts the lab knows.

    With `redact`, a text that may identify somebody is replaced by REDACTED; `redacted` lists the places.
    """

    people: Mapping[str, Identity] = field(default_factory=dict)
    redact: bool = False
    redacted: list[str] = field(default_factory=list)

    def demand_columns(self, file: str, columns: Iterable[str]) -> None:
        """Raise ExportRefused on a column whose name suggests that it identifies people."""
        for name in columns:
            if word := identifying_word(name):
                raise ExportRefused(
                    f"{file}: column {name!r} is about {word!r}, which identifies a person;"
                    f" leave it out with --without {name}"
                )

    def watched(self, table: Table, file: str) -> Iterator[Row]:
        """Yield the table's rows unchanged. Raises ExportRefused at the first one that identifies somebody."""
        free = [column for column in table.columns if column.free_answer]
        for number, row in enumerate(table.rows(), start=1):
            # The value as it is, or REDACTED (nothing in the place of a number). No error shows the value itself.
            checked = {}
            for column in free:
                value = row.get(column.name)
                checked[column.name] = value
                looks = self.looks(cell_text(value)) if value is not None else None
                if looks is None:
                    continue
                place = f"{file}: row {number}, column {column.name!r}"
                if not self.redact:
                    name = row.get("item", column.name)
                    raise ExportRefused(
                        f"{place}: the text there looks like {looks}; leave it out everywhere with --without {name},"
                        " or have such texts blackened with --redact"
                    )
                self.redacted.append(place)
                checked[column.name] = REDACTED if isinstance(value, str) else None
            yield {**row, **checked} if checked else row

    def demand_pseudonyms(self, participants: Iterable[str]) -> None:
        """Raise ExportRefused on a pseudonym that contains an identity number or the participant's name."""
        for place, pseudonym in enumerate(participants, start=1):
            own = self.people.get(pseudonym, Identity()).name or ""
            words = unicodedata.normalize("NFKC", own).casefold().split()
            telling = {"".join(words), *(word for word in words if len(word) > 2)} - {""}
            if re.search(rf"\d{{{_FEWEST},}}", pseudonym) or pseudonym.casefold().rstrip("0123456789") in telling:
                raise ExportRefused(
                    f"participant {place} of the export: the pseudonym itself identifies a person (their name, or"
                    f" {_FEWEST} digits or more); such sessions cannot be shared"
                )

    def looks(self, text: str) -> str | None:
        """Return what identifies somebody in a text ('an e-mail address', ...), None if nothing does."""
        plain = unicodedata.normalize("NFKC", text).casefold()
        kind = next((what for what, pattern in IDENTIFYING_PATTERNS.items() if pattern.search(plain)), None)
        numbers = [match[0] for match in _DIGITS.finditer(plain) if not re.fullmatch(r"\d+\.\d+", match[0])]
        if kind is None and any(_FEWEST <= sum(map(str.isdigit, number)) <= _MOST for number in numbers):
            kind = "a telephone or identity number"
        if kind is None and any(_mentions(plain, known) for known in self._known()):
            kind = "the name or the contact of a person in the lab's registry"
        return kind

    def _known(self) -> Iterator[str]:
        for person in self.people.values():
            for text in (person.name, person.contact):
                if text and (len(text) > 2 or _has_no_blanks(text)):
                    plain = unicodedata.normalize("NFKC", text).casefold()
                    yield plain
                    yield " ".join(reversed(plain.split()))


def identifying_word(name: str) -> str | None:
    """Return the word in a column's name that suggests identifying data, in a dozen languages; None if none does."""
    if word := identifying(name):
        return word
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", unicodedata.normalize("NFC", name))
    # a vowel sign of Devanagari is no letter to \W: words end only where something else than letter and mark stands
    words = "".join(c if unicodedata.category(c)[0] in "LM" else " " for c in spaced).casefold().split()
    known = {unicodedata.normalize("NFC", word) for word in IDENTIFYING_WORDS}
    pairs = [first + second for first, second in pairwise(words)]
    return next((word for word in (*words, *pairs) if word in known), None)


def _mentions(text: str, known: str) -> bool:
    """Return whether a text contains a name.

    Korean, Chinese and Japanese names need no blanks around them, since particles follow at once.
    """
    if _has_no_blanks(known):
        return known.replace(" ", "") in text.replace(" ", "")
    apart = r"[\s,]+".join(map(re.escape, known.split()))
    return re.search(rf"(?<!\w){apart}(?!\w)", text) is not None


def _has_no_blanks(text: str) -> bool:
    return re.search(r"[\u3040-\u30ff\u3400-\u9fff\uac00-\ud7af]", text) is not None
