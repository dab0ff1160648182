"""Simulated surfaces: one height field that is both touched with a tool and photographed, so that vision and touch
agree.
"""
