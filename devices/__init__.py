"""Devices that touch the participant or the stimulus, and a simulated twin of each.

A new kind of device of one module goes into `instruments/`; one with a folder has a line in the table of `kinds`.
"""

if __name__ != "palpate.devices":
    raise ImportError("this package is palpate.devices: from palpate import devices")
