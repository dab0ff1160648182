"""Vibration in the hand: a voice coil, its limits, and the filter that makes its response flat."""
