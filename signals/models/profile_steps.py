"""The steps that know what a force profile is: its features, and what of it may be played."""

from __future__ import annotations

import numpy as np

from palpate.signals.doors.grid import POINTS, DoorDataError
from palpate.signals.models.card import DoorFeatures, Playable
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.form import At, Built, Form, Kept, Values


def door_features(step: DoorFeatures, form: Form, at: At) -> Built:
    """Return the engineered features that the card names. A name that is unknown here is refused."""
    from palpate.protocols.did_you_mean import nearest
    from palpate.signals.doors.model_features import FEATURES, features

    _require_profile(form, at)
    if unknown := [name for name in step.names if name not in FEATURES]:
        raise at.refuse(f"there is no feature {unknown[0]!r} here; {nearest(unknown[0], FEATURES)}")
    if not step.names:
        raise at.refuse("it names no features; at least one is expected")

    def run(x: Values, _kept: Kept) -> Values:
        try:
            return features(x, step.names)
        except DoorDataError as error:
            raise ModelInputError(str(error)) from None

    return run, Form((len(step.names),), owned=True)


def playable(step: Playable, form: Form, at: At) -> Built:
    """Return every profile within the limits."""
    from palpate.signals.doors.limits import bounded

    _require_profile(form, at)

    def run(x: Values, _kept: Kept) -> Values:
        rows = [bounded(row, step.force_N, step.slope_N_deg) for row in x.astype(np.float64, copy=False)]
        return np.where(np.isfinite(x), np.stack(rows), np.nan)

    return run, Form(form.shape, owned=True)


def _require_profile(form: Form, at: At) -> None:
    if form.shape != (POINTS,):
        raise at.refuse(f"shape {form.shape} comes to it; the {POINTS} forces of a profile are expected")
