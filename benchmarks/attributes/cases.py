"""Features of recordings and pictures, and the attributes predicted from them."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.attributes import methods, picture_features, touch, touch_features
from palpate.protocols.bench import Case


def cases(quick: bool) -> Iterator[Case]:
    """Yield every case of this area."""
    for part in (touch_features, picture_features, touch, methods):
        yield from part.cases(quick)
