"""What a task may ask of the world, and what comes back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from protocols.plan import Trial


class ReplyError(ValueError):
    """A reply that does not answer its request: a fault of the presenter, never of the participant."""


@dataclass(frozen=True)
class Present:
    """Let the participant feel the trial's stimulus."""

    trial: Trial

    def body(self) -> dict[str, Any]:
        """What the ledger keeps of the request."""
        return {"do": "present", "stimulus": self.trial.stimulus.id}


@dataclass(frozen=True)
class Ask:
    """Put a form before the participant: every item is to be answered, or the participant goes back."""

    form: str
    trial: Trial

    def demand_answer(self, reply: Reply) -> None:
        """Raise ReplyError unless every item is answered on the scale, or the participant may go back and does."""
        number, value = self.trial.number, reply.value
        if value.get("go") == "back":
            if not self.trial.may_go_back:
                raise ReplyError(f"trial {number}: the reply goes back, which this trial does not allow")
            return
        answers, names = value.get("answers"), [attribute.name for attribute in self.trial.attributes]
        if not isinstance(answers, Mapping) or sorted(answers) != sorted(names):
            raise ReplyError(f"trial {number}: answers to {names} expected, found {answers!r:.200}")
        for name, answer in answers.items():
            if not self.trial.scale.holds(answer):
                raise ReplyError(f"trial {number}: {name} = {answer!r} is not on the study's scale")

    def body(self) -> dict[str, Any]:
        """What the ledger keeps of the request."""
        return {
            "do": "ask",
            "form": self.form,
            "items": [attribute.name for attribute in self.trial.attributes],
            "back": self.trial.may_go_back,
            "previous": self.trial.previous,
        }


@dataclass(frozen=True)
class Sense:
    """Record a device's channels for some seconds."""

    device: str
    seconds: float
    trial: Trial

    def body(self) -> dict[str, Any]:
        """What the ledger keeps of the request."""
        return {"do": "sense", "device": self.device, "seconds": self.seconds}


@dataclass(frozen=True)
class Rest:
    """A break; `done` of `total` counted trials are behind the participant."""

    done: int
    total: int

    def body(self) -> dict[str, Any]:
        """What the ledger keeps of the request."""
        return {"do": "rest", "done": self.done, "total": self.total}


@dataclass(frozen=True)
class Instruct:
    """Show a page of text, by its name in the study."""

    page: str

    def body(self) -> dict[str, Any]:
        """What the ledger keeps of the request."""
        return {"do": "instruct", "page": self.page}


Request = Present | Ask | Sense | Rest | Instruct


@dataclass(frozen=True)
class Samples:
    """A block of samples of one stream: `data` holds rows of channels, little-endian float32."""

    stream: str
    channels: tuple[str, ...]
    units: tuple[str, ...]
    rate_hz: float
    t0_ns: int
    data: bytes

    @property
    def count(self) -> int:
        """Samples per channel."""
        return len(self.data) // (4 * len(self.channels))


@dataclass(frozen=True)
class Reply:
    """What the world answered: JSON data, and the samples recorded meanwhile."""

    value: Mapping[str, Any]
    samples: tuple[Samples, ...] = ()
