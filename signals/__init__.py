"""The numeric ground floor: what the rig and the trainer must compute alike. NumPy, and no device."""

if __name__ != "palpate.signals":
    raise ImportError("this package is palpate.signals: from palpate import signals")

GRAVITY_M_S2 = 9.80665
"""Standard gravity (CGPM 1901)."""
