"""Vibration in the hand: a voice coil, what keeps it within bounds, what makes its response flat."""
