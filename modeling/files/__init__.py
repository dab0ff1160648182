"""Trained models and results as files that cannot execute code.

A rig finds models by `palpate.devices.models.lookup`.
"""
