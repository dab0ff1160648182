"""The counterbalancing of a study so far: who holds which row, and how often each item was at each position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from palpate.analysis.ratings.sample import sample_facts
from palpate.protocols.balance import Balance, certificate, has_parts
from palpate.protocols.blinding import aliases
from palpate.protocols.orders import rows_of
from palpate.protocols.study import Study

RANK = ("complete", "running", "interrupted", "allocated", "aborted", "declined", "ineligible", "released", "withdrawn")
"""The order of states: a row is shown with the first of these that one of its holders has."""
GIVEN_UP = ("released", "withdrawn")
COUNTED = ("complete", "running")


@dataclass(frozen=True)
class Holder:
    """A participant on a row, with a session's status, or `allocated` without a session.

    `session` is the session's number; None if the study declares only one, or there is none yet.
    """

    participant: str
    group: str | None
    row: int
    status: str
    order: tuple[str, ...] = ()
    session: int | None = None

    @property
    def text(self) -> str:
        """The participant, with the session's number if there are several."""
        return self.participant if self.session is None else f"{self.participant}, session {self.session}"


@dataclass(frozen=True)
class DesignRow:
    """A row of the design with a participant; `place` is the row within the design's cycle."""

    place: int
    state: str
    holders: tuple[Holder, ...]


@dataclass(frozen=True)
class GroupBalance:
    """The balance of one group of a study: its design's rows, and the certificate over the orders that count.

    `rows` has only rows with participants; `round` is the number of rows in the design, 1 for random or fixed orders.
    `of_sessions` has a certificate for each session by its number, where the study declares several.
    """

    group: str | None
    design: str
    round: int
    rows: tuple[DesignRow, ...]
    certificate: Balance
    of_sessions: Mapping[int, Balance] = field(default_factory=dict)

    @property
    def counts(self) -> dict[str, int]:
        """The number of rows in each state; free rows have no holder."""
        numbers = {state: sum(row.state == state for row in self.rows) for state in RANK}
        taken = sum(row.state not in GIVEN_UP for row in self.rows)
        return {state: n for state, n in numbers.items() if n} | {"free": self.round - taken}

    @property
    def verdict(self) -> str:
        """The certificate in words."""
        if self.design == "as_listed":
            return "Everybody meets the stimuli as listed: there is nothing to balance."
        return self.certificate.text() if self.certificate.sequences else "No complete or running session yet."


@dataclass(frozen=True)
class StudyBalance:
    """The balance of one version of a study by group, and the state of its planned sample (label, text)."""

    study: str
    title: str
    digest: str
    groups: tuple[GroupBalance, ...]
    sample: Mapping[str, Any] = field(default_factory=dict)

    @property
    def sample_facts(self) -> tuple[tuple[str, str], ...]:
        """The planned and the achieved sample, as labels and texts."""
        return tuple(sample_facts(self.sample))


def balance_of(study: Study, digest: str, holders: Sequence[Holder], sample: Mapping[str, Any]) -> StudyBalance:
    """Return the balance of a study with these holders; `sample` is the achieved part of the planned sample.

    The stimuli of a blind study are numbered, since a person who sees the orders may guide a participant's hand.
    """
    if named := aliases(study):
        holders = [replace(holder, order=tuple(named[name] for name in holder.order)) for holder in holders]
    groups: list[str | None] = [*sorted(study.groups)] or [None]
    design = study.order.design if study.order.blocks is None else f"{study.order.design} within blocks"
    balances, part = [], has_parts(study)
    for group in groups:
        length, of_group = round_of(study, group), [holder for holder in holders if holder.group == group]
        counted = [holder for holder in of_group if holder.status in COUNTED and holder.order]
        of_sessions = {
            number: certificate((holder.order for holder in counted if holder.session == number), part)
            for number in sorted({holder.session or 1 for holder in counted} if study.sessions > 1 else ())
        }
        together = certificate((holder.order for holder in counted), part)
        by_place: dict[int, list[Holder]] = {}
        for holder in sorted(of_group, key=lambda one: (RANK.index(one.status), one.participant, one.session or 0)):
            by_place.setdefault(holder.row % length, []).append(holder)
        rows = tuple(DesignRow(place, own[0].status, tuple(own)) for place, own in sorted(by_place.items()))
        balances.append(GroupBalance(group, design, length, rows, together, of_sessions))
    return StudyBalance(study.study, study.title or study.study, digest, tuple(balances), sample)


def round_of(study: Study, group: str | None) -> int:
    """Return how many rows the design of a group has before its orders repeat."""
    stimuli, blocks = study.stimuli_of(group), study.order.blocks
    if blocks is None:
        return rows_of(study.order.design, len(stimuli))
    members: dict[str, int] = {}
    for stimulus in stimuli:
        name = stimulus.columns[blocks.by]
        members[name] = members.get(name, 0) + 1
    inner = max(rows_of(study.order.design, n) for n in members.values())
    return rows_of(blocks.design, len(members)) * inner
