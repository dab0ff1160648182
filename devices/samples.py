"""Physical samples: the experimenter puts a sample in place and confirms it (thesis 3.3.2, 4.7.1)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from palpate.devices.acts import Act, going_on
from palpate.devices.desk import Desk, Pages, Prompt
from palpate.protocols.events import Aside, Present, Reply
from palpate.protocols.study import Stimulus

TELLING = ("label", "material", "position")
"""Columns of a stimulus table that identify the sample and its place."""


def described(stimulus: Stimulus, blind: Sequence[str] = ()) -> str:
    """Return the stimulus by its id and its columns: T07 (sandpaper P60, box 3).

    If columns are `blind`, neither they nor the id, which may reveal them, are shown: sandpaper P60, box 3.
    """
    seen = [name for name in TELLING if name not in blind]
    texts = [text for name in seen if (text := stimulus.columns.get(name, "")) not in ("", stimulus.id)]
    if blind:
        return ", ".join(texts) or "a stimulus that the study keeps blind"
    return f"{stimulus.id} ({', '.join(texts)})" if texts else stimulus.id


def mounting(stimulus: Stimulus, blind: Sequence[str] = ()) -> Prompt:
    """Return the prompt to put the stimulus in place before the participant can feel it."""
    return Prompt(f"Put in place: {described(stimulus, blind)}")


@dataclass
class HandMounted:
    """A presenter of samples that a person mounts, while the participant is asked to wait.

    The participant explores without a time limit and answers while feeling, so the presentation ends when the
    experimenter confirms: `seconds` is how long the change took.
    """

    act: Act | None = None
    blind: Sequence[str] = ()

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: Callable[[], int]) -> Reply | Aside:
        """Prompt for the sample and wait for the confirmation; the prompt stays after an aside."""
        self.act = act = going_on(self.act, request, now_ns)
        desk.demand(mounting(request.trial.stimulus, self.blind))
        aside = act.wait("changing_sample", window, desk, now_ns, lambda: desk.answer() is not None)
        if aside is not None:
            return aside
        desk.demand(None)
        self.act = None
        return Reply({"presented": True, "by": "experimenter", "seconds": act.seconds(now_ns())})
