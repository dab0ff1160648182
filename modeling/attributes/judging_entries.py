"""Which methods are judged on which features: as they were published, on this study's, and kind by kind."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from palpate.modeling.attributes.judging_jobs import KINDS, MAIN, SAME, Entry
from palpate.modeling.attributes.material import SIGHT, TOUCH
from palpate.modeling.attributes.methods import Method

PROPOSED = "visuo_tactile"
SEEING, FEELING = "hv_net", "ht_net"
"""The thesis' network, and its two branches each by itself."""
ON_REQUEST = ("visuo_tactile_thesis",)
"""What takes hours a fold is evaluated only where it is named."""
COMPARED = ("vision_cnn", "haptic_cnn", "tactile_cnn_lstm", "tactile_svm", SEEING, FEELING)
"""Those of Table 3.4."""
PLAIN = "ridge"
"""The kinds of features are also told apart by a method without chance or training in epochs."""
SIGHTS: tuple[tuple[str, ...], ...] = (("resnet",), ("glcm",), SIGHT)
TOUCHES: tuple[tuple[str, ...], ...] = (("dwt", "hand"), ("dft", "hand"), TOUCH)
Own = Mapping[str, tuple[Sequence[str], Sequence[str]]]


def entries(names: Iterable[str], methods: Mapping[str, Method], own: Own, ablations: bool = True) -> tuple[Entry, ...]:
    """Every method with its own features (`own`: touch and sight by method; else this study's), then Table 3.4 and 3.5.

    A method with the same features in several tables is fitted once.
    """
    found: dict[Entry, frozenset[str]] = {}

    def add(table: str, each: Entry) -> None:
        found[each] = found.get(each, frozenset()) | {table}

    chosen = tuple(names)
    for name in chosen:
        add(MAIN, _entry(methods[name], *own.get(name, (TOUCH, SIGHT))))
    for name in chosen if ablations else ():
        if name in COMPARED:
            add(SAME, _entry(methods[name], TOUCH, SIGHT))
        for touch, sight in _kinds(name):
            add(KINDS, _entry(methods[name], touch, sight))
    return tuple(Entry(each.method, each.touch, each.sight, tables) for each, tables in found.items())


def _entry(method: Method, touch: Sequence[str], sight: Sequence[str]) -> Entry:
    """Only what the method looks at."""
    felt = tuple(touch) if "touch" in method.sees else ()
    return Entry(method.name, felt, tuple(sight) if "sight" in method.sees else ())


def _kinds(name: str) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
    """The features of Table 3.5 for this method, as (touch, sight)."""
    seen = [((), sight) for sight in SIGHTS] if name in (SEEING, PLAIN) else []
    felt = [(touch, ()) for touch in TOUCHES] if name in (FEELING, PLAIN) else []
    both: list[tuple[tuple[str, ...], tuple[str, ...]]] = [(TOUCH, SIGHT)] if name in (PROPOSED, PLAIN) else []
    return [*seen, *felt, *both]
