"""Shipped models under fresh hands: every measure of every method, scored once, beside a second recording."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.synthesis import free_running
from benchmarks.synthesis.free_running import AGAIN, LOOKS, METHODS, cases
from tests.modeling.textures.recording_for_tests import recording

CARDS = {"rough": {"ar": Path("rough-ar.json"), "foten_generative": Path("rough-foten.json"), "gan": Path("gan.json")}}


class Surfaces:
    """The truth, and another realisation of it."""

    def scene(self, texture, seconds, seed):
        return recording(seconds, seed, texture).signals

    def again(self, texture, seconds, seed):
        signals = self.scene(texture, seconds, seed).copy()
        signals[0] = recording(seconds, 900 + seed, texture).signals[0]
        return signals


def test_every_look_at_every_method_from_one_run_of_each(monkeypatch):
    played = []

    def play(card, speed, _force, seed):
        """Another realisation of the truth as autoregression, and half of it as the generative network."""
        played.append((card.stem, seed))
        share = 1.0 if "ar" in card.stem else 0.5
        return share * recording(len(speed) / 1000, seed, "rough").signals[0]

    monkeypatch.setattr(free_running, "play", play)
    all_cases = list(cases(True, Surfaces(), CARDS, clock=iter(np.arange(100.0)).__next__))
    assert [case.method for case in all_cases] == [AGAIN, *METHODS] * len(LOOKS)
    errors = {(case.case, case.method): case.error(case.run()) for case in all_cases}
    assert errors["rough: level", "foten_generative"] == pytest.approx(0.5)
    assert errors["rough: felt_dB", "ar"] == pytest.approx(0.0, abs=1e-9)
    assert 0 < errors["rough: felt_dB", AGAIN] < errors["rough: felt_dB", "foten_generative"]
    assert errors["rough: smoothed_gfc", "foten_generative"] == pytest.approx(0.0, abs=1e-9)
    assert [name for name, _ in played] == ["rough-foten", "rough-ar"]
    assert all_cases[0].seconds(all_cases[0].run()) == 1.0
