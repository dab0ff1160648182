"""YAML as data only: one document, no aliases, no tags, no repeated keys, and the line of each value."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, ClassVar

import yaml

LARGEST_BYTES = 1_000_000
DEEPEST = 40
LONGEST_NUMBER = 300
Path = tuple[str | int, ...]
_PREFIX = "tag:yaml.org,2002:"
_CORE = (
    ("bool", r"^(?:true|false)$", "tf"),
    ("null", r"^(?:~|null|)$", ("~", "n", "")),
    ("int", r"^[-+]?[0-9]+$", "-+0123456789"),
    ("float", r"^[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?$", "-+.0123456789"),
)
_ALLOWED = {_PREFIX + kind for kind in ("str", "map", "seq", *(name for name, _, _ in _CORE))}


class YamlError(ValueError):
    """An error for text that is not the plain YAML that Palpate reads; the message names file, line and reason."""


@dataclass(frozen=True)
class Document:
    """The data of a YAML text and the 1-based line of every value by its path."""

    data: Any
    lines: dict[Path, int]


def load(text: bytes, name: str) -> Document:
    """Return the document in `text`; `name` is the file's name in messages.

    Raises YamlError on text that is not UTF-8 or too large, on anchors, aliases, tags, repeated keys and syntax.
    """
    lines: dict[Path, int] = {}
    try:
        loader = _PlainLoader(_decoded(text, name))
        node = loader.get_single_node()
        if node is None:
            raise YamlError(f"{name}: the file is empty")
        _survey(node, (), lines, name)
        return Document(loader.construct_document(node), lines)
    except yaml.reader.ReaderError as error:
        raise YamlError(f"{name}: character {error.character!r:.12} is not allowed in YAML") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f" line {mark.line + 1}, column {mark.column + 1}:" if mark else ""
        in_brackets = "expected ',' or" in (error.problem or "")
        hint = "; close it, or quote a text that holds ? or : or , within it" if in_brackets else ""
        raise YamlError(f"{name}:{where} {', '.join(filter(None, (error.context, error.problem)))}{hint}") from None


class _PlainLoader(yaml.SafeLoader):
    """A loader for the core scalars of YAML 1.2 only: `no`, `12:30` and `2024-01-01` stay texts."""

    yaml_implicit_resolvers: ClassVar[dict[str, list[tuple[str, Any]]]] = {  # type: ignore[misc]
        first: [(_PREFIX + kind, re.compile(pattern)) for kind, pattern, firsts in _CORE if first in firsts]
        for first in {letter for _, _, firsts in _CORE for letter in firsts}
    }

    depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        event = self.peek_event()  # type: ignore[no-untyped-call]
        if getattr(event, "anchor", None) is not None:
            problem = "anchors and aliases (& and *) are not read here; write the value out"
            raise yaml.composer.ComposerError(None, None, problem, event.start_mark)
        if self.depth > DEEPEST:
            problem = f"nested deeper than {DEEPEST} levels"
            raise yaml.composer.ComposerError(None, None, problem, event.start_mark)
        self.depth += 1
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        digits = str(self.construct_scalar(node))
        if len(digits) > LONGEST_NUMBER:
            problem = f"a number of {len(digits)} digits; at most {LONGEST_NUMBER} are read"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        return int(digits)


_PlainLoader.add_constructor(_PREFIX + "int", _PlainLoader.construct_yaml_int)


def _decoded(text: bytes, name: str) -> str:
    if len(text) > LARGEST_BYTES:
        raise YamlError(f"{name}: {len(text):,} bytes; a file of at most {LARGEST_BYTES:,} bytes is expected")
    try:
        return text.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, byte = text[: error.start].count(b"\n") + 1, text[error.start]
        raise YamlError(f"{name}: line {line}: byte 0x{byte:02x} is not UTF-8; save as UTF-8") from None


def _survey(node: yaml.Node, path: Path, lines: dict[Path, int], name: str) -> None:
    line = lines[path] = node.start_mark.line + 1
    if node.tag not in _ALLOWED:
        raise YamlError(f"{name}: line {line}: the tag {node.tag} is not read here; write plain values")
    if isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            _survey(item, (*path, index), lines, name)
    elif isinstance(node, yaml.MappingNode):
        _survey_mapping(node, path, lines, name)


def _survey_mapping(node: yaml.MappingNode, path: Path, lines: dict[Path, int], name: str) -> None:
    seen: set[str] = set()
    for key, value in node.value:
        line = key.start_mark.line + 1
        if not isinstance(key, yaml.ScalarNode):
            raise YamlError(f"{name}: line {line}: a key must be plain text")
        # 1, 01 and "1" are the same key
        whole = key.tag == _PREFIX + "int" and len(key.value) <= LONGEST_NUMBER
        plain = str(int(key.value)) if whole else str(key.value)
        if plain in seen:
            raise YamlError(f"{name}: line {line}: the key {key.value!r} appears twice")
        seen.add(plain)
        _survey(value, (*path, key.value), lines, name)
