"""Reliability: the agreement of raters, items and repetitions."""
