"""Tables as a Word file in APA style: rules above, below the head and at the end; equal bytes each time."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Sequence
from xml.sax.saxutils import escape

from palpate.analysis.reports.tables import NumberedTable, Table, table_letters

EPOCH = (1980, 1, 1, 0, 0, 0)
"""The date on every part of the file, instead of the time at which it is saved."""
UPRIGHT, TURNED = 95, 140
"""The most letters of a table that fits an upright, or a rotated, page in nine points; a wider one is smaller."""
_RULE = '<w:{side} w:val="single" w:sz="{size}" w:space="0" w:color="1F2328"/>'


def word_bytes(title: str, lead: str, tables: Sequence[NumberedTable]) -> bytes:
    """Return every table with number, title and notes; wide ones on rotated pages, with heads on each page."""
    from docx import Document as new_document
    from docx.enum.section import WD_ORIENT, WD_SECTION
    from docx.oxml import parse_xml
    from docx.oxml.ns import nsdecls
    from docx.shared import Cm

    document = new_document()
    properties = document.core_properties
    properties.title, properties.author, properties.comments = allowed(title), "", ""
    document.add_heading(allowed(title), level=1)
    if lead:
        document.add_paragraph(lead)
    turned = False
    for table in tables:
        if (table_letters(table.table) > UPRIGHT) != turned:
            turned = not turned
            # A section whose pages lie on their side, or stand again.
            section = document.add_section(WD_SECTION.NEW_PAGE)
            section.orientation = WD_ORIENT.LANDSCAPE if turned else WD_ORIENT.PORTRAIT
            section.page_width, section.page_height = section.page_height, section.page_width
            section.left_margin = section.right_margin = Cm(2)
        end = document.add_paragraph()
        # "Table 3" as Word numbers tables itself, so that a list of tables and cross-references work.
        number_xml = f"<w:r><w:rPr><w:b/></w:rPr><w:t>{table.number}</w:t></w:r>"
        words = '<w:r><w:rPr><w:b/></w:rPr><w:t xml:space="preserve">Table </w:t></w:r>'
        field = rf'<w:fldSimple w:instr=" SEQ Table \* ARABIC ">{number_xml}</w:fldSimple>'
        for xml in (
            f'<w:p><w:pPr><w:keepNext/><w:spacing w:before="240" w:after="0"/></w:pPr>{words}{field}</w:p>',
            _line(table.title, "<w:i/>", with_next=True),
            _grid(table.table),
        ):
            end._p.addprevious(parse_xml(xml.replace(">", f" {nsdecls('w')}>", 1)))
        for note in table.notes:
            end._p.addprevious(parse_xml(_line(note, '<w:sz w:val="17"/>').replace(">", f" {nsdecls('w')}>", 1)))
    # The same date on every part, for equal bytes.
    saved, result = io.BytesIO(), io.BytesIO()
    document.save(saved)
    with zipfile.ZipFile(saved) as original, zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED) as timeless:
        for name in original.namelist():
            timeless.writestr(zipfile.ZipInfo(name, EPOCH), original.read(name), zipfile.ZIP_DEFLATED)
    return result.getvalue()


def allowed(text: str) -> str:
    """Return the text without characters that XML cannot represent."""
    return re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]", "", text)


def _line(text: str, look: str, with_next: bool = False) -> str:
    layout = f'<w:pPr>{"<w:keepNext/>" * with_next}<w:spacing w:before="40" w:after="80"/></w:pPr>'
    return f"<w:p>{layout}{_run(text, look)}</w:p>"


def _run(text: str, look: str) -> str:
    return f'<w:r><w:rPr>{look}</w:rPr><w:t xml:space="preserve">{escape(allowed(text))}</w:t></w:r>'


def _grid(table: Table) -> str:
    """Return the table's XML as a whole, since adding cells through the library takes minutes for a long table."""
    rules = "".join(_RULE.format(side=side, size=8) for side in ("top", "bottom"))
    margins = '<w:tblCellMar><w:left w:w="40" w:type="dxa"/><w:right w:w="60" w:type="dxa"/></w:tblCellMar>'
    head = f'<w:tblPr><w:tblW w:w="5000" w:type="pct"/><w:tblBorders>{rules}</w:tblBorders>{margins}</w:tblPr>'
    size = 18 if table_letters(table) <= TURNED else 14
    rows = [_row(table, [head.name for head in table.heads], size, head=True)]
    for place, cells in enumerate(table.rows):
        if place in table.groups:
            # A heading across the table, which stays with the row below it.
            layout = '<w:pPr><w:keepNext/><w:spacing w:before="60" w:after="0"/></w:pPr>'
            words = _run(table.groups[place], f'<w:i/><w:sz w:val="{size}"/>')
            span = f'<w:tcPr><w:gridSpan w:val="{len(table.heads)}"/></w:tcPr>'
            rows.append(f"<w:tr><w:trPr><w:cantSplit/></w:trPr><w:tc>{span}<w:p>{layout}{words}</w:p></w:tc></w:tr>")
        rows.append(_row(table, cells, size, head=False))
    columns = "<w:gridCol/>" * len(table.heads)
    return f"<w:tbl>{head}<w:tblGrid>{columns}</w:tblGrid>{''.join(rows)}</w:tbl>"


def _row(table: Table, cells: Sequence[str], size: int, *, head: bool) -> str:
    rule = f"<w:tcPr><w:tcBorders>{_RULE.format(side='bottom', size=6)}</w:tcBorders></w:tcPr>" * head
    look = f'<w:sz w:val="{size}"/>'
    cells_xml = []
    for text, column in zip(cells, table.heads, strict=True):
        side = "right" if column.kind == "number" else "left"
        layout = f'<w:pPr>{"<w:keepNext/>" * head}<w:spacing w:after="0"/><w:jc w:val="{side}"/></w:pPr>'
        cells_xml.append(f"<w:tc>{rule}<w:p>{layout}{_run(text, look)}</w:p></w:tc>")
    return f"<w:tr><w:trPr><w:cantSplit/>{'<w:tblHeader/>' * head}</w:trPr>{''.join(cells_xml)}</w:tr>"
