"""Trained models at the rig: read from their files, run with NumPy alone, listed and compared."""
