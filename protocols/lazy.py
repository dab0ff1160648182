"""Objects named "module:NAME", which are imported when they are needed: naming one must not load its libraries."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Generic, TypeVar, cast

T = TypeVar("T")


def load_object(place: str) -> Any:
    """Import the module of "module:NAME" and return its NAME. Raises ImportError and AttributeError."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def lazy_function(place: str) -> Callable[..., Any]:
    """Return a function that calls the one named "module:NAME", which is imported at the first call."""

    def call(*arguments: Any, **options: Any) -> Any:
        return load_object(place)(*arguments, **options)

    return call


@dataclass(frozen=True)
class LazyTable(Mapping[str, T], Generic[T]):
    """Objects by name, in the order of `places`, which says where each one is: "module:NAME"."""

    places: Mapping[str, str]

    def __getitem__(self, name: str) -> T:
        return cast(T, load_object(self.places[name]))

    def __iter__(self) -> Iterator[str]:
        return iter(self.places)

    def __len__(self) -> int:
        return len(self.places)
