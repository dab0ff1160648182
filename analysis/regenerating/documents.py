"""The tables of a regenerated study for a manuscript: one Word file, and one LaTeX file to be read in with \\input."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from analysis.regenerating.regenerated import Regenerated
from analysis.regenerating.shown import by_test, method_of, rests_on, test_table, test_title
from analysis.reporting.page_table import Table

if TYPE_CHECKING:
    from docx.document import Document

EPOCH = (1980, 1, 1, 0, 0, 0)
_LATEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "−": "$-$", "–": "--", "×": r"$\times$", "χ": r"$\chi$", "η": r"$\eta$", "ε": r"$\varepsilon$", "α": r"$\alpha$",
    "τ": r"$\tau$", "σ": r"$\sigma$", "β": r"$\beta$", "ω": r"$\omega$", "ρ": r"$\rho$", "±": r"$\pm$", "≥": r"$\geq$",
    "≤": r"$\leq$", "°": r"$^\circ$", "₁": "$_1$", "₂": "$_2$", "→": r"$\rightarrow$", "…": r"\dots{}",
    **{sign: f"$^{digit}$" for digit, sign in enumerate("⁰¹²³⁴⁵⁶⁷⁸⁹")},
}  # fmt: skip


def titled_tables(found: Regenerated) -> Iterator[tuple[str, str, Table]]:
    """Each test as a table: its title, what stands below it, and its rows."""
    for answered in by_test(found.answered):
        note = " ".join(filter(None, (method_of(answered), rests_on(answered))))
        yield test_title(answered), note, test_table(answered)


def latex_text(found: Regenerated) -> str:
    """Every table in LaTeX (packages booktabs and longtable), letters that TeX reads otherwise escaped."""
    parts = [rf"% {escaped(found.title)}: tables. Needs \usepackage{{booktabs,longtable}}"]
    parts += [_latex_table(title, note, shown) for title, note, shown in titled_tables(found)]
    return "\n\n".join(parts) + "\n"


def escaped(text: str) -> str:
    """A text that TeX sets as it stands."""
    return "".join(_LATEX.get(letter, letter) for letter in text)


def _latex_table(title: str, note: str, shown: Table) -> str:
    align = "".join({"number": "r", "words": "p{5cm}"}.get(column.kind, "l") for column in shown.columns)
    lines = [rf"\begin{{longtable}}{{{align}}}", rf"\caption{{{escaped(title)}}}\\", r"\toprule"]
    lines += [_latex_row([column.name for column in shown.columns]), r"\midrule", r"\endhead"]
    lines += [_latex_row(row) for row in shown.rows]
    lines += [r"\bottomrule", r"\end{longtable}"]
    lines += [rf"\noindent\footnotesize {escaped(each)}\par" for each in (*shown.notes, note) if each]
    return "\n".join(lines)


def _latex_row(cells: Sequence[str]) -> str:
    return " & ".join(map(escaped, cells)) + r" \\"


def word_bytes(found: Regenerated) -> bytes:
    """Every table as a Word file, set as the APA asks (rules above, below the head, and at the end); equal bytes."""
    from docx import Document as new_document

    document = new_document()
    properties = document.core_properties
    properties.title, properties.author, properties.comments = found.title, "", ""
    document.add_heading(_allowed(found.title), level=1)
    if found.material.simulated:
        document.add_paragraph("Simulated participants: no person gave these answers.")
    for number, (title, note, shown) in enumerate(titled_tables(found), start=1):
        _word_table(document, f"Table {number}", title, note, shown)
    return _timeless(document)


def _allowed(text: str) -> str:
    """Without the control characters that no XML can hold."""
    return re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f]", "", text)


def _word_table(document: Document, label: str, title: str, note: str, shown: Table) -> None:
    from docx.oxml import parse_xml

    document.add_paragraph().add_run(label).bold = True
    document.add_paragraph().add_run(_allowed(title)).italic = True
    end = document.add_paragraph()
    end._p.addprevious(parse_xml(_word_grid(shown)))
    for line in (*shown.notes, note):
        if line:
            document.add_paragraph(_allowed(line), style="Caption")


def _word_grid(shown: Table) -> str:
    """The table's XML in one piece: cell by cell through the library a long table takes minutes."""
    from docx.oxml.ns import nsdecls

    rules = "".join(f'<w:{side} w:val="single" w:sz="8" w:space="0" w:color="1F2328"/>' for side in ("top", "bottom"))
    head = f'<w:tblPr><w:tblW w:w="5000" w:type="pct"/><w:tblBorders>{rules}</w:tblBorders></w:tblPr>'
    grid = "".join("<w:gridCol/>" for _ in shown.columns)
    rows = [_word_row(shown, [column.name for column in shown.columns], head=True)]
    rows += [_word_row(shown, row, head=False) for row in shown.rows]
    return f"<w:tbl {nsdecls('w')}>{head}<w:tblGrid>{grid}</w:tblGrid>{''.join(rows)}</w:tbl>"


def _word_row(shown: Table, cells: Sequence[str], *, head: bool) -> str:
    rule = (
        '<w:tcPr><w:tcBorders><w:bottom w:val="single" w:sz="6" w:space="0" w:color="1F2328"/></w:tcBorders></w:tcPr>'
    )
    made = []
    for text, column in zip(cells, shown.columns, strict=True):
        side = "right" if column.kind == "number" else "left"
        layout = f'<w:pPr><w:spacing w:after="0"/><w:jc w:val="{side}"/></w:pPr>'
        words = f'<w:r><w:rPr><w:sz w:val="18"/></w:rPr><w:t xml:space="preserve">{escape(_allowed(text))}</w:t></w:r>'
        made.append(f"<w:tc>{rule * head}<w:p>{layout}{words}</w:p></w:tc>")
    repeated = "<w:trPr><w:tblHeader/></w:trPr>" * head
    return f"<w:tr>{repeated}{''.join(made)}</w:tr>"


def _timeless(document: Document) -> bytes:
    """The file with the same date on every part: a Word file otherwise holds the hour it was saved."""
    saved, result = io.BytesIO(), io.BytesIO()
    document.save(saved)
    with zipfile.ZipFile(saved) as given, zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED) as made:
        for name in given.namelist():
            made.writestr(zipfile.ZipInfo(name, EPOCH), given.read(name), zipfile.ZIP_DEFLATED)
    return result.getvalue()


def write_documents(found: Regenerated, folder: Path) -> list[Path]:
    """Write tables.docx and tables.tex."""
    word, latex = folder / "tables.docx", folder / "tables.tex"
    word.write_bytes(word_bytes(found))
    latex.write_text(latex_text(found), encoding="utf-8", newline="\n")
    return [word, latex]
