"""Families of switches: those of one maker, and those that share a brand's name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

NO_BRANDS = frozenset({"Lubed", "CK"})
"""First words that are no brand: a treatment, and a shop's initials before `x MAKER`."""


def families(names: Sequence[str], makers: Sequence[str]) -> tuple[str, ...]:
    """Return a family for each switch, named by its first member.

    A brand is the first word of a name, or of a part of it after ` x ` ("Ajazz x Huano Banana": Ajazz, Huano). Two
    switches are of one family if they have a brand or a known maker in common, or if a third one links them. That may
    join unrelated switches, but does not separate related ones as far as names and makers show.
    """
    brands = {part.split()[0] for name in names for part in name.split(" x ")} - NO_BRANDS
    linked = _Linked()
    for name, maker in zip(names, makers, strict=True):
        linked.join(("switch", name), *(("brand", word) for word in name.split() if word in brands))
        if maker:
            linked.join(("switch", name), ("maker", maker))
    return _names_of_families(names, [linked.root(("switch", name)) for name in names])


def _names_of_families(names: Sequence[str], groups: Iterable[tuple[str, str]]) -> tuple[str, ...]:
    first: dict[tuple[str, str], str] = {}
    return tuple(first.setdefault(root, name) for name, root in zip(names, groups, strict=True))


class _Linked:
    """Sets that can be joined (union-find)."""

    def __init__(self) -> None:
        self._above: dict[tuple[str, str], tuple[str, str]] = {}

    def root(self, item: tuple[str, str]) -> tuple[str, str]:
        """Return the representative of the set that holds the item."""
        above = self._above.setdefault(item, item)
        return item if above == item else self.root(above)

    def join(self, *items: tuple[str, str]) -> None:
        """Join the sets of these items."""
        for item in items[1:]:
            self._above[self.root(item)] = self.root(items[0])
