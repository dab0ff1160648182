"""The entries of an evaluation: methods with the features as published, this study's, and single kinds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from palpate.modeling.attributes.material import SIGHT, TOUCH
from palpate.modeling.attributes.methods import Method

MAIN, SAME, KINDS = "methods", "same features", "kinds"
"""The tables of an entry: Tables 3.2 and 3.3, Table 3.4, Table 3.5."""
PROPOSED = "visuo_tactile"
SEEING, FEELING = "hv_net", "ht_net"
"""The two branches of the thesis' network (`PROPOSED`), each by itself."""
ON_REQUEST = ("visuo_tactile_thesis",)
"""Methods that take hours per fold, evaluated only where they are named."""
COMPARED = ("vision_cnn", "haptic_cnn", "tactile_cnn_lstm", "tactile_svm", SEEING, FEELING)
"""The methods of Table 3.4."""
PLAIN = "ridge"
"""A method without randomness or epochs, which also compares the kinds of features."""
SIGHTS: tuple[tuple[str, ...], ...] = (("resnet",), ("glcm",), SIGHT)
TOUCHES: tuple[tuple[str, ...], ...] = (("dwt", "hand"), ("dft", "hand"), TOUCH)
Own = Mapping[str, tuple[Sequence[str], Sequence[str]]]


@dataclass(frozen=True)
class Entry:
    """A method with its kinds of features, and the tables that show it."""

    method: str
    touch: tuple[str, ...]
    sight: tuple[str, ...]
    tables: frozenset[str] = field(default=frozenset({MAIN}), compare=False)

    @property
    def name(self) -> str:
        """The entry's name in tables and files."""
        return f"{self.method}: {'+'.join((*self.touch, *self.sight)) or 'ratings alone'}"


def entries(names: Iterable[str], methods: Mapping[str, Method], own: Own, ablations: bool = True) -> tuple[Entry, ...]:
    """Return every method with its own features (`own`: touch and sight by method; else this study's).

    With `ablations` also those of Tables 3.4 and 3.5. A method with the same features in several tables is one entry.
    """
    tables: dict[Entry, frozenset[str]] = {}

    def add(table: str, name: str, touch: Sequence[str], sight: Sequence[str]) -> None:
        sees = methods[name].sees  # an entry has only the modalities of its method
        entry = Entry(name, tuple(touch) if "touch" in sees else (), tuple(sight) if "sight" in sees else ())
        tables[entry] = tables.get(entry, frozenset()) | {table}

    names = tuple(names)
    for name in names:
        add(MAIN, name, *own.get(name, (TOUCH, SIGHT)))
    for name in names if ablations else ():
        if name in COMPARED:
            add(SAME, name, TOUCH, SIGHT)
        if name in (SEEING, PLAIN):
            for sight in SIGHTS:
                add(KINDS, name, (), sight)
        if name in (FEELING, PLAIN):
            for touch in TOUCHES:
                add(KINDS, name, touch, ())
        if name in (PROPOSED, PLAIN):
            add(KINDS, name, TOUCH, SIGHT)
    return tuple(Entry(entry.method, entry.touch, entry.sight, of) for entry, of in tables.items())
