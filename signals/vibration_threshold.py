"""The least vibration that a hand feels, and the third-octave bands in which it is examined.

The threshold of the Pacinian channel of glabrous skin is U-shaped in displacement, least at 250 to 300 Hz at about
0.1 um (-20 dB re 1 um, peak), and falls at -12 dB per octave towards it; below about 40 Hz the non-Pacinian channel NP
I detects, at about -5 dB per octave (Verrillo 1963; Bolanowski, Gescheider, Verrillo and Checkosky 1988; Gescheider,
Bolanowski and Hardick 2001). These are straight lines through published curves for a large contactor (2.9 cm^2): good
to about 5 dB, and no threshold of the hand that holds a stylus. The curve decides only what is not felt at all.
"""

from __future__ import annotations

import math

BANDS_HZ = (25.0, 31.5, 40.0, 50.0, 63.0, 80.0, 100.0, 125.0, 160.0, 200.0, 250.0, 315.0, 400.0)
"""Nominal middles of the third octaves that lie within 20 to 500 Hz (IEC 61260-1)."""
LEAST_DB, LEAST_HZ = -20.0, (250.0, 300.0)
"""Minimum of the displacement threshold in dB re 1 um (peak), and the frequencies where it lies."""
CHANGE_HZ = 40.0
STEEP_DB, FLAT_DB = 12.0, 5.0
"""Rise of the threshold per octave: of the Pacinian channel on either side, and below 40 Hz."""


def threshold_m_s2(hertz: float) -> float:
    """Return the least acceleration (RMS, m/s^2) that is felt at a frequency from 10 to 500 Hz."""
    low, high = LEAST_HZ
    rise = STEEP_DB * (math.log2(low / max(hertz, CHANGE_HZ)) if hertz < low else max(0.0, math.log2(hertz / high)))
    rise += FLAT_DB * max(0.0, math.log2(CHANGE_HZ / hertz))
    peak_m = 1e-6 * 10 ** ((LEAST_DB + rise) / 20)
    return (2 * math.pi * hertz) ** 2 * peak_m / math.sqrt(2)


def band_edges_hz(middle_hz: float) -> tuple[float, float]:
    """Return the lower and the upper edge of a third octave, in Hz."""
    return middle_hz * 2 ** (-1 / 6), middle_hz * 2 ** (1 / 6)
