"""Which column names have a meaning of their own, so that no factor and no kept column may take them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

OF_THE_TABLE = (
    "participant", "attribute", "value", "group", "study", "session", "trial", "block", "stimulus",
    "response_time_s", "revised",
)  # fmt: skip
"""The columns that a table of ratings has, or may have, beside its factors."""
OF_THE_MEANS = ("kind", "n", "mean", "sd", "sd_reason", "ratings", "ratings_min", "ratings_max", "category")
"""The columns that a table of means has beside its factors."""
RESERVED = frozenset((*OF_THE_TABLE, *OF_THE_MEANS))


def taken_names(roles: Mapping[str, Iterable[str]]) -> Iterator[tuple[str, str]]:
    """Yield each (role, name) whose name is reserved, but 'group' may be a between factor: it means just that."""
    for role, names in roles.items():
        for name in names:
            if name in RESERVED and (role, name) != ("between", "group"):
                yield role, name
