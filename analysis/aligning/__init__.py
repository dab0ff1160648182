"""Streams of different rates and clocks on one grid of session time, with the error of every way stated."""
