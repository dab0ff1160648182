"""Recordings in the layout of the Penn Haptic Texture Toolkit."""

import numpy as np

from tests.modeling.textures.textures_for_tests import hand, vibration

RATE = 10_000
N = 8_000
UNITS = {"AccelUnits": "m/s^2", "ForceUnits": "N", "PositionUnits": "mm", "SpeedUnits": "mm/s"}


def array(name, values):
    cells = "".join(f"<value>{value:.6f}</value>\n" for value in values)
    return f'<{name} type="array">\n{cells}</{name}>\n'


def axes(name, table, form=array):
    return f"<{name}>" + "".join(form(axis, column) for axis, column in zip("xyz", table.T, strict=True)) + f"</{name}>"


def spaced(name, values):
    return f"<{name}>{' '.join(f'{value:.6f}' for value in values)}</{name}>"


def signals(n=N, rate=RATE):
    speed, force = hand(n, rate)
    felt = np.stack([vibration(n, seed) for seed in range(3)], axis=1)
    place = np.stack([np.cumsum(speed) / rate, np.zeros(n), 0.01 * vibration(n)], axis=1)
    return felt, speed, force, place


def whole(units=UNITS, rate=RATE, n=N, force_n=None, declared=""):
    felt, speed, force, place = signals(n)
    unit_tags = "".join(f"<{name}>{unit}</{name}>" for name, unit in units.items())
    rate_tag = f"<SampleRate>{rate}</SampleRate>" if rate else ""
    parts = [axes("Accel", felt), array("ForceNormal", force[:force_n]), axes("Position", place, spaced)]
    return (
        f'<?xml version="1.0" encoding="utf-8"?>{declared}<recording><material>Felt</material>{unit_tags}{rate_tag}'
        f"{''.join(parts)}{spaced('Speed', speed)}</recording>"
    )
