"""Read XML of other programs safely."""

from __future__ import annotations

from xml.etree import ElementTree


class EntitiesDeclared(ValueError):
    """An XML text that declares entities, a few lines of which can expand to gigabytes."""


def xml_root(content: bytes) -> ElementTree.Element:
    """Return the root of an XML text in UTF-8.

    Raises UnicodeDecodeError, EntitiesDeclared, and ElementTree.ParseError or ValueError for malformed XML.
    """
    text = content.decode("utf-8-sig")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise EntitiesDeclared("entities")
    return ElementTree.fromstring(text)
