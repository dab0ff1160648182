"""How the stored texts are made and compared: commands run, pages read, and what varies left out."""

from __future__ import annotations

import difflib
import math
import os
import re
import shlex
import shutil
from datetime import UTC, date, datetime
from html.parser import HTMLParser
from pathlib import Path

from palpate import command_line

HERE = Path(__file__).parent
EXPECTED = HERE / "expected"
PLANS = HERE / "plans"
ROOT = HERE.parents[1]
RECORDED = ROOT / "tests" / "recorded"
FROZEN = RECORDED / "frozen"
RENEW = bool(os.environ.get("RENEW_SNAPSHOTS"))
WIDTH = 100
NUMBER = re.compile(
    r"(?<![\w.])[-−]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)?(?:e[-+−]?\d+)?(?!\w|\.\d)|(?<![\w.])[-−]?\.\d+"
)
LEFT_OUT = {
    "a file that Palpate brings, wherever it lies": (
        r"CHECKOUT/(?:[\w-]+/)*?([\w-]+/study\.yaml|[\w-]+\.\w+)",
        r"SHIPPED/\1",
    ),
    "the digest of a ledger, which names the packages' versions": (r"\bdigest [0-9a-f]{16}\b", "digest DIGEST"),
    "the digests in JSON": (r'"(head|head_hash|last_hash|ledger_sha256)":\s?"[0-9a-f]{64}"', r'"\1":"DIGEST"'),
    "how long something took": (r"\b(in|took|takes|after) [\d.,]+ (s|ms|min)\b(?! of)", r"\1 TIME"),
    "the same in words": (r"The answers took [^.]*?(\d\.\d)?[^.]*? when", "The answers took TIME when"),
    "how long ago a file was changed": (r"\b\d[\w ]*? ago\b", "WHILE ago"),
    "a day and an hour by this computer's clock": (r"\b\d{1,2} [A-Z][a-z]{2}, \d\d:\d\d\b", "WHEN"),
    "the same where a page ends": (r"\bAs of \d\d:\d\d:\d\d\b", "As of WHEN"),
    "a model's time to answer here": (r"(one answer here, ms) .*", r"\1 TIME"),
    "both as JSON": (r'"(at|last_event_age_s)":\s?[\d.e+]+', r'"\1":TIME'),
    "how much faster than life": (r"\([\d,]+ times as fast\)", "(N times as fast)"),
    "the same in numbers": (r'"(seconds|rate|took_s|times_as_fast|train_s|ms)":\s?[\d.e+-]+', r'"\1":TIME'),
    "the computer's name": (r"stations/[\w.-]+/", "stations/HOST/"),
    "versions of packages": (
        r"\b((?i:pingouin|statsmodels|SciPy|NumPy|pandas|Python|torch|matplotlib|SQLAlchemy)) \d+\.\d[\w.+]*",
        r"\1 VERSION",
    ),
    "how far another package's number is from ours, in the last bits": (
        r"(the largest relative difference is |VERSION \| \d+ \| )(0|\d(\.\d+)?e-1\d)(?![\de-])",
        r"\1TINY",
    ),
    "the digests of a ledger": (r"(\.sqlite \| |last event )[0-9a-f]{64}( \| [0-9a-f]{64})?", r"\1DIGEST"),
    "a table of versions": (r"(?m)^([\w.-]+ \| )\d+\.\d+[\w.+]*$", r"\1VERSION"),
}
"""What differs between two runs or machines: the reason, the pattern, and what stands in its place."""
RECORDED_AT = 1_795_600_000
RECORDED_DAYS = (date(2026, 11, 20), date(2026, 11, 28))
"""When the recorded sessions and the frozen lab were made: such a day may be that of this run, or look like it."""


def compare(name: str, text: str, tolerance: float = 0) -> None:
    """Compare a text with expected/NAME.txt, or keep it there. Raises AssertionError with the lines that differ.

    With a tolerance, numbers that differ by this share of the larger one or less are taken as equal.
    """
    file = EXPECTED / f"{name}.txt"
    if RENEW:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    if not file.is_file():
        raise AssertionError(f"no snapshot {name}: RENEW_SNAPSHOTS=1")
    stored = file.read_text(encoding="utf-8")
    if tolerance:
        text = with_near_numbers(text, stored, tolerance)
    if text != stored:
        lines = difflib.unified_diff(stored.splitlines(), text.splitlines(), f"kept {name}", "now", lineterm="", n=1)
        raise AssertionError("\n" + "\n".join(line.rstrip() for line in lines))


def with_near_numbers(text: str, stored: str, tolerance: float) -> str:
    """Return the text with the stored number in place of each that is near it, in lines with equal words."""
    number = re.compile(r"((?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w))")

    def nearer(line: str, stored_line: str) -> str:
        parts, stored_parts = number.split(line), number.split(stored_line)
        near = (
            math.isclose(float(a), float(b), rel_tol=tolerance, abs_tol=min(tolerance, 1e-6))
            for a, b in zip(parts[1::2], stored_parts[1::2], strict=True)
        )
        return stored_line if parts[::2] == stored_parts[::2] and all(near) else line

    lines, stored_lines = text.split("\n"), stored.split("\n")
    return "\n".join([*map(nearer, lines, stored_lines), *lines[len(stored_lines) :]])


def make_lab(folder: Path) -> None:
    """Copy the frozen lab into the folder, as LAB, and the foreign table and the profile that lie beside it."""
    shutil.copytree(FROZEN, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("README.md", "expected.json"))
    (folder / "lab").rename(folder / "LAB")
    for path in (folder / "LAB" / "sessions").iterdir():
        os.utime(path, (RECORDED_AT, RECORDED_AT))  # a session that was written to just now counts as running


def call(line: str, capsys) -> None:
    """Run a command that must succeed and whose text is of no interest."""
    status = command_line._status(shlex.split(line))
    out, err = capsys.readouterr()
    if status:
        raise AssertionError(f"palpate {line}: {status}\n{out}{err}")


def run(lines: list[str], folder: Path, capsys) -> str:
    """Run the commands one after another and return all they print, and their exit codes."""
    parts = []
    for line in lines:
        status = command_line._status(shlex.split(line))
        out, err = capsys.readouterr()
        errors = [f"-- {err.rstrip()}"] if err.strip() else []
        parts += [f"$ palpate {line}", out.rstrip("\n"), *errors, f"= {status}\n"]
    return without_what_varies("\n".join(parts), folder)


def without_what_varies(text: str, folder: Path) -> str:
    """Leave out what differs between two runs or machines: folders, the time of this run, and LEFT_OUT."""
    text = text.replace(str(folder), "FOLDER").replace(str(ROOT), "CHECKOUT")
    text = re.sub(r"\b(\d{4}-\d\d-\d\d)([T ]\d\d:\d\d[\d:.]*(Z|[+-]\d\d:\d\d)?)?\b", _without_now, text)
    for pattern, instead in LEFT_OUT.values():
        text = re.sub(pattern, instead, text)
    return text


def _without_now(match: re.Match[str]) -> str:
    """Return DATE for today, here or elsewhere, and for the days of the recordings; another day stays as it is."""
    try:
        day = date.fromisoformat(match[1])
    except ValueError:
        return match[0]
    is_now = abs((day - datetime.now(UTC).date()).days) <= 1
    return "DATE" if is_now or RECORDED_DAYS[0] <= day <= RECORDED_DAYS[1] else match[0]


def without_numbers(text: str) -> str:
    """Replace each number by #, how long something took by TIME, and the spaces that make columns by one.

    The remaining time is left out: below five seconds it is not printed, and that depends on the machine.
    """
    text = re.sub(r"(?<![\w.])(?=\w*[a-f])[0-9a-f]{16,64}\b", "DIGEST", text)
    text = re.sub(r"(?m)^(Data, SHA-256)\n[0-9a-f]{12}$", r"\1\nDIGEST", text)
    text = re.sub(r"(?m)^.* done: job .*$\n?|^.*captured in .*$\n?", "", text)
    text = re.sub(r"native \([^)]*\)", "native (CPU)", text)
    lines = (line if line.startswith(("$ ", "= ")) else NUMBER.sub("#", line) for line in text.split("\n"))
    text = re.sub(r"# (h|min|s|ms|µs)( # (min|s))?\b", "TIME", "\n".join(lines))
    text = re.sub(r"; about TIME left$", "", text, flags=re.MULTILINE)
    return re.sub(r" +(\n|$)", r"\1", re.sub(r" {2,}", " ", text))


class PageReader(HTMLParser):
    """What a person reads of a page: a line for each paragraph or row of a table, and the words on its marks."""

    LINES = frozenset({
        "p", "div", "section", "article", "header", "footer", "main", "nav", "h1", "h2", "h3", "h4", "h5", "h6",
        "li", "ul", "ol", "dl", "dt", "dd", "table", "caption", "thead", "tbody", "tr",
        "figure", "figcaption", "details", "summary", "title", "br", "pre",
        "form", "fieldset", "legend", "option", "button", "select", "label",
    })  # fmt: skip
    SILENT = frozenset({"script", "style", "svg"})
    NAMED = ("alt", "title", "aria-label", "placeholder")

    def __init__(self, most_rows: int) -> None:
        super().__init__()
        self.most_rows = most_rows
        self.rows = 0
        self.lines: list[str] = [""]
        self.silent = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a line where the page does, and a cell where the table does."""
        if tag in self.SILENT:
            self.silent += 1
        self.rows = 0 if tag == "table" else self.rows + (tag == "tr")
        if tag in self.LINES:
            self.lines.append("#" * int(tag[1]) + " " if re.fullmatch(r"h\d", tag) else "")
        if tag in ("td", "th") and self.lines[-1].strip():
            self.lines[-1] += " | "
        words = [f"[{name}: {value}]" for name, value in attrs if name in self.NAMED and value]
        if words and (self.silent == 0 or tag == "svg"):
            self.lines[-1] += " ".join(["", *words, ""])

    def handle_endtag(self, tag: str) -> None:
        """End the line; leave out a row beyond those that are wanted."""
        if tag in self.SILENT:
            self.silent -= 1
        if tag == "tr" and self.rows > self.most_rows + 1:
            del self.lines[-1]
        if tag == "table" and self.rows > self.most_rows + 1:
            self.lines.append(f"({self.rows} rows)")
        if tag in self.LINES:
            self.lines.append("")

    def handle_data(self, data: str) -> None:
        """Add the words, unless they are a script's or a picture's."""
        if not self.silent:
            self.lines[-1] += data


def read_page(html: str, most_rows: int = 1000) -> str:
    """Return the text of a page, a readable line for each paragraph and row; at most so many rows of each table."""
    reader = PageReader(most_rows)
    reader.feed(html)
    reader.close()
    lines = [" ".join(line.split()) for line in reader.lines]
    return "\n".join(line for line in lines if line.strip("# "))
