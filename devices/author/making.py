"""What the window needs of whatever makes a door from wishes."""

from palpate.devices.door.making import HIGHEST, LOWEST, NEUTRAL, Array, Made, Maker, maker_for

__all__ = ["HIGHEST", "LOWEST", "MOST_SMOOTHING_DEG", "NEUTRAL", "Array", "Made", "Maker", "maker_for"]

MOST_SMOOTHING_DEG = 5.0
"""How far a profile can be smoothed."""
