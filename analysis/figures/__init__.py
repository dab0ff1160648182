"""Figures: the data table of each, and its drawing from that table alone.

A new one is a module here with a `FigureKind`, and a line in `FIGURES` of `palpate.analysis.plans.kinds`.
"""
