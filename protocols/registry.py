"""Registries: the parts of one kind by name, each imported only when it is used, named as "module:NAME"."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from typing import Any, Generic, TypeVar, cast

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.extensions import ExtensionError, finder, is_own

T = TypeVar("T")


def load_object(place: str) -> Any:
    """Import the module of "module:NAME" and return the object NAME. Raises ImportError and AttributeError."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def place_in(package: str, module: str, name: str) -> str:
    """Return the place "package.module:name" of a part in a module of a package."""
    return f"{package}.{module}:{name}"


def lazy_function(place: str) -> Callable[..., Any]:
    """Return a function that calls the one named "module:NAME", which is imported at the first call."""

    def call(*arguments: Any, **options: Any) -> Any:
        return load_object(place)(*arguments, **options)

    return call


@dataclass(frozen=True)
class Registry(Mapping[str, T], Generic[T]):
    """The parts of one kind by name, such as tests, figures, devices or methods, in the order of lists.

    `places` holds the place of each part ("module:NAME"). Parts that are quick to import may be in `families` instead:
    modules with a mapping `KINDS` of parts by name, so that a new part is one line in its own module. `parts` are plain
    data, which need no import. `folder` ("package.*") is a package each of whose modules is a part, named like the
    module and described by its `KIND`: a new part is a new file. `kind` is the kind of parts that extensions can add
    under names with a dot; such a name raises ExtensionError where it cannot be found. Lists hold the parts of
    extensions that were loaded by their names. `of` is the place of the class that they are instances of.
    """

    places: Mapping[str, str] = field(default_factory=dict)
    families: tuple[str, ...] = ()
    parts: Mapping[str, T] = field(default_factory=dict)
    folder: str = ""
    kind: str = ""
    of: str = ""

    @cached_property
    def all_places(self) -> Mapping[str, str]:
        """Return the places of the parts in `places` and `folder`, without importing them."""
        if not self.folder:
            return self.places
        from pkgutil import iter_modules

        package = self.folder.removesuffix(".*")
        names = [module.name for module in iter_modules(import_module(package).__path__)]
        return {**self.places, **{name: f"{package}.{name}:KIND" for name in names}}

    @cached_property
    def _of_families(self) -> Mapping[str, T]:
        found: dict[str, T] = dict(self.parts)
        for family in self.families:
            for name, part in cast(Mapping[str, T], load_object(f"{family}:KINDS")).items():
                if name in found or name in self.places:
                    raise ValueError(f"{family}: {name!r} is registered twice")
                found[name] = part
        return found

    def __getitem__(self, name: str) -> T:
        if self.kind and is_own(name):
            return self._own(name, finder().part(self.kind, name))
        if (place := self.places.get(name) or self.all_places.get(name)) is not None:
            return cast(T, load_object(place))
        return self._of_families[name]

    def _own(self, name: str, part: Any) -> T:
        """Return a part of an extension. Raises ExtensionError unless it is what parts of this kind are."""
        expected = load_object(self.of)
        if not isinstance(part, expected):
            raise ExtensionError(f"{name} is {part!r:.60}; a {expected.__name__} is expected among {self.kind}")
        return cast(T, part)

    def why_not(self, name: object, what: str) -> str | None:
        """Return why no part has this name, for a message that calls parts `what`; None if one has it."""
        try:
            if isinstance(name, str) and name in self:
                return None
        except ExtensionError as error:
            return str(error)
        return f"no {what} {name!r:.40}; {nearest(str(name), self)}"

    def __contains__(self, name: object) -> bool:
        if self.kind and is_own(name):
            return self[cast(str, name)] is not None
        return name in self.all_places or name in self._of_families

    def __iter__(self) -> Iterator[str]:
        yield from self.all_places
        yield from self._of_families
        yield from finder().parts(self.kind)

    def __len__(self) -> int:
        return sum(1 for _ in self)
