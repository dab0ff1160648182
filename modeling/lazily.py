"""Things by name whose modules are imported when they are asked for: naming a method must not load its libraries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Generic, TypeVar, cast

T = TypeVar("T")


@dataclass(frozen=True)
class Lazily(Mapping[str, T], Generic[T]):
    """By name, in the order in which they are shown; `places` says where each is: `module:attribute`."""

    places: Mapping[str, str]

    def __getitem__(self, name: str) -> T:
        module, _, attribute = self.places[name].partition(":")
        return cast(T, getattr(import_module(module), attribute))

    def __iter__(self) -> Iterator[str]:
        return iter(self.places)

    def __len__(self) -> int:
        return len(self.places)
