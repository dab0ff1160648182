"""Vibration stimuli at the skin: an actuator with a calibration in dB, hard limits, and a watchdog."""
