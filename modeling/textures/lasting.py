"""A short recording is gone through more often: a training is so many steps, not so many epochs."""

from __future__ import annotations

from dataclasses import replace

from palpate.modeling.textures.methods import Learning
from palpate.modeling.training.settings import Settings

SAMPLES = 14_000
"""The training part of 20 s (thesis 4.3.3), for which a method's epochs are meant."""
MOST = 10.0
"""Times as many epochs at most."""


def for_length(settings: Settings, learning: Learning) -> Settings:
    """Epochs and patience for the length of the recording's training part; at 20 s and above they are as given."""
    samples = sum(stop - start for start, stop in learning.parts.train)
    times = min(MOST, max(1.0, SAMPLES / max(1, samples)))
    patience = {
        name: round(times * value)
        for name in ("plateau_patience", "stop_patience")
        if (value := getattr(settings, name)) is not None
    }
    return replace(settings, epochs=round(times * settings.epochs), **patience)
