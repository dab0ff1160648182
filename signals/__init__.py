"""Numerical code that the rig and the training of models must compute alike. NumPy only, no devices."""

if __name__ != "palpate.signals":
    raise ImportError("this package is palpate.signals: from palpate import signals")

GRAVITY_M_S2 = 9.80665
"""Standard gravity (CGPM 1901)."""
