"""Labels that a reader takes for one and a program for two: '01' and '1', '1' and '1.0', two ways to write 'é'."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pandas as pd

from palpate.analysis.ratings.design_report import Place
from palpate.protocols.lookalikes import looks


def lookalikes(table: pd.DataFrame, columns: Sequence[str]) -> Iterator[Place]:
    """Each set of different labels in one column that differ only in how a number, a letter or a blank is written."""
    for column in columns:
        alike: dict[str, set[str]] = {}
        for label in table[column].dropna().unique().tolist():
            alike.setdefault(looks(str(label)), set()).add(str(label))
        for labels in alike.values():
            if len(labels) > 1:
                yield Place(column, found=" and ".join(ascii(label) for label in sorted(labels)))
