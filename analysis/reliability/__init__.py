"""Reliability: how far raters, items and repetitions agree."""
