"""The jobs of an evaluation by leaving one texture out: a method with its features, and the texture left out."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from palpate.modeling.attributes.folds import Fold
from palpate.modeling.attributes.material import Pair
from palpate.modeling.attributes.methods import Method
from palpate.protocols.progress import Clock
from palpate.signals.arrays import Array

MAIN, SAME, KINDS = "methods", "same features", "kinds"
"""What an entry stands in: Tables 3.2 and 3.3, Table 3.4, Table 3.5."""


@dataclass(frozen=True)
class Entry:
    """A method with the features that it looks at; `tables` are those that it stands in."""

    method: str
    touch: tuple[str, ...]
    sight: tuple[str, ...]
    tables: frozenset[str] = field(default=frozenset({MAIN}), compare=False)

    @property
    def name(self) -> str:
        """As tables and files name it."""
        return f"{self.method}: {'+'.join((*self.touch, *self.sight)) or 'ratings alone'}"


@dataclass(frozen=True)
class Job:
    """One entry fitted without one texture, and asked about it."""

    entry: Entry
    test: str

    @property
    def name(self) -> str:
        """As progress and errors name it."""
        return f"{self.entry.name}, without {self.test}"


@dataclass(frozen=True)
class Context:
    """What all jobs share.

    The textures lie in `stored`, a file that each process reads once; `digest` is that of all that is in it, and
    `parts` of each texture and kind, so that a job is kept as long as what it looks at is the same. `settings` go to
    the methods as they are; `work` is the folder of finished jobs, None where nothing is kept.
    """

    stored: Path
    digest: str
    parts: Mapping[str, str]
    attributes: tuple[Pair, ...]
    folds: Mapping[str, Fold]
    methods: Mapping[str, Method]
    seed: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)
    work: Path | None = None
    clock: Clock = time.perf_counter


@dataclass(frozen=True)
class Done:
    """A finished job: the texture's prediction, its spread over its rows, seconds, learning curve; or why refused.

    `numbers`: train_s, asked_s, rows. `arrays`: predicted (attributes,) on 0..100, spread (attributes,), curve_*.
    """

    job: Job
    numbers: Mapping[str, float] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    refused: str = ""

    @property
    def predicted(self) -> Array:
        """(attributes,) on 0..100."""
        found: Array = self.arrays["predicted"]
        return found
