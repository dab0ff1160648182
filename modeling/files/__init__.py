"""Trained models and results as files that cannot execute code."""
