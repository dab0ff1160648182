"""All that models know of touch: rows of numbers, one a segment, by kind (thesis 3.4.1, Table 3.5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.features.hand import hand
from palpate.analysis.features.mfcc import COEFFICIENTS, FRAMES, mfcc
from palpate.analysis.features.segments import SEGMENT, contact, segments
from palpate.analysis.features.spectra import spectrum
from palpate.analysis.features.touch import Touch
from palpate.analysis.features.wavelets import LEVELS, STATISTICS, wavelets

SIZES = {
    "mfcc": FRAMES * COEFFICIENTS,
    "hand": 6,
    "dft": SEGMENT // 2,
    "dwt": (LEVELS + 1) * len(STATISTICS),
}
"""Numbers in a row of each kind: 520, 6, 250, 24. `mfcc` and `hand` are the thesis' 526."""


def touch_features(touch: Touch) -> dict[str, NDArray[np.float32]]:
    """A row for each segment with contact, by kind: mfcc (s, 520), hand (s, 6), dft (s, 250), dwt (s, 24).

    A row of `mfcc` is frame after frame: reshaped to (40, 13) it is time by coefficient. Raises FeatureError where no
    stretch is as long as a segment, and where there is no contact.
    """
    cut = segments(touch).only(contact(touch))
    found = {
        "mfcc": mfcc(cut.vibration).reshape(len(cut.vibration), -1),
        "hand": hand(cut.speed_mm_s, cut.force_N),
        "dft": spectrum(cut.vibration),
        "dwt": wavelets(cut.vibration),
    }
    return {kind: rows.astype(np.float32) for kind, rows in found.items()}
