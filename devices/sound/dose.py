"""The daily dose of noise at the ear.

The rule is that of WHO and ITU for personal audio (ITU-T H.870, mode 1): 80 dB(A) for 40 hours a week, which is 8 hours
a day of a five-day week; 3 dB more halve the time. NIOSH (1998) allows 85 dB(A) for 8 hours a day by the same exchange
rate; the stricter rule is taken, because participants are not at work.
"""

from __future__ import annotations

import math

DAILY_DB_A, DAILY_S = 80.0, 8 * 3600.0
EXCHANGE_DB = 10 * math.log10(2)
"""The level by which a doubled time counts: equal energy, 3 dB."""
RULE = "80 dB(A) for 8 h a day, 3 dB exchange (ITU-T H.870)"


def share_of_day(db_a: float, seconds: float) -> float:
    """Return the share of the daily dose that so many seconds of this level are; 1 is the whole dose."""
    return max(seconds, 0.0) / DAILY_S * float(10 ** ((db_a - DAILY_DB_A) / 10))


def seconds_left(db_a: float, share_before: float) -> float:
    """Return how long this level may sound today after this share of the dose."""
    return max(0.0, 1.0 - share_before) * DAILY_S * float(10 ** ((DAILY_DB_A - db_a) / 10))
