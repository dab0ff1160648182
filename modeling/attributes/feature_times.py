"""The time that the features of one texture take on this machine, measured on synthetic signals."""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Collection, Iterator
from itertools import chain

import numpy as np

from palpate.modeling.attributes.material import SIGHT_KINDS, TOUCH_KINDS
from palpate.modeling.textures.preparing import Touched
from palpate.modeling.textures.rates import evenly
from palpate.protocols.progress import Clock
from palpate.signals.arrays import Array

SECONDS, PICTURES = 60.0, 10
"""The data of a texture: seconds of recording by sensors of 3, 8 and 0.12 kHz; pictures of 1568 x 1568 pixels."""
RECORDING, PICTURE = "recording", "picture"
"""The steps before any kind of feature of touch (one clock, filters, hum, DFT321), and of sight (decoding, gray)."""
TONES_HZ = (31.0, 47.0, 83.0, 127.0, 173.0, 229.0, 311.0, 389.0)
"""Tones within the band, none a multiple of the mains frequency."""
SENSORS_HZ = {"acceleration": 3000.0, "force": 8000.0, "position": 120.0}
GRAVITY_M_S2 = 9.81


def steps_of(kinds: Collection[str]) -> tuple[str, ...]:
    """Return the steps to these kinds of features: the common step of each modality once, then each kind."""
    before = ((RECORDING, TOUCH_KINDS), (PICTURE, SIGHT_KINDS))
    return (*(name for name, own in before if set(own) & set(kinds)), *kinds)


def feature_seconds(kinds: Collection[str], clock: Clock = time.perf_counter) -> dict[str, float]:
    """Return the seconds of each step to these kinds (`steps_of`) for one texture, on one core, from raw data.

    Each step is run twice and the second run counts. ResNet-50 is timed on one batch of patches and scaled to all
    patches of the ten pictures.
    """
    from palpate.modeling.training.threads import limited

    steps, result = steps_of(kinds), {}
    with limited(1):
        for name, make, times in chain(_touch_steps(steps), _sight_steps(steps)):
            if name in steps:
                make()
                start = clock()
                make()
                result[name] = (clock() - start) * times
    return result


def _touch_steps(steps: Collection[str]) -> Iterator[tuple[str, Callable[[], object], float]]:
    """Yield the steps of touch, if any is among them: a name, a function to time, how often one texture needs it."""
    from palpate.analysis.features.touch import segments
    from palpate.analysis.features.touch_features import hand, mfcc, spectrum, wavelets
    from palpate.modeling.attributes.reading_touch import touch_of

    if RECORDING not in steps:
        return
    touched = tones(SECONDS)
    cut = segments(touch_of("made up", [touched])[0])
    yield RECORDING, lambda: segments(touch_of("made up", [touched])[0]), 1.0
    yield "mfcc", lambda: mfcc(cut.vibration), 1.0
    yield "hand", lambda: hand(cut.speed_mm_s, cut.force_N), 1.0
    yield "dft", lambda: spectrum(cut.vibration), 1.0
    yield "dwt", lambda: wavelets(cut.vibration), 1.0


def _sight_steps(steps: Collection[str]) -> Iterator[tuple[str, Callable[[], object], float]]:
    """Yield the steps of sight, on a JPEG file of noise, as `_touch_steps`."""
    from PIL import Image

    from palpate.analysis.features.glcm import glcm
    from palpate.analysis.features.pictures import SIDE, Looking, patches, square

    if PICTURE not in steps:
        return
    pixels = np.random.Generator(np.random.PCG64(0)).integers(0, 256, (SIDE, SIDE, 3), dtype=np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=92)
    photo = file.getvalue()
    picture = square(photo, "made up").values
    yield PICTURE, lambda: square(photo, "made up"), float(PICTURES)
    yield "glcm", lambda: glcm(picture), float(PICTURES)
    if "resnet" in steps:
        from palpate.modeling.attributes.resnet import (
            BATCH,
            fold_batch_norms,
            load_network,
            pool_of_patches,
            random_state,
        )

        network, cut = fold_batch_norms(load_network(random_state(0))), patches(picture, Looking())
        yield "resnet", lambda: pool_of_patches(network, cut[:BATCH]), PICTURES * len(cut) / BATCH


def tones(seconds: float) -> Touched:
    """Return a synthetic capture with known vibration (`felt_at`), gravity, and a hand that strokes slowly."""
    times_s = {what: np.arange(round(seconds * rate_hz)) / rate_hz for what, rate_hz in SENSORS_HZ.items()}
    t = times_s["position"]
    place = np.stack([40 * np.sin(3 * t), 40 * np.cos(3 * t), 0 * t], axis=1)
    force = 1.2 + 0.5 * np.cos(2 * times_s["force"])
    signals = {
        "acceleration": felt_at(times_s["acceleration"]) + np.array([0, 0, GRAVITY_M_S2]),
        "force": np.stack([0 * force, 0 * force, force], axis=1), "position": place,
    }  # fmt: skip
    sampled = {what: evenly(what, values, SENSORS_HZ[what], "made up") for what, values in signals.items()}
    return Touched("made up", sampled["acceleration"], sampled["force"], position=sampled["position"])


def felt_at(times_s: Array) -> Array:
    """Return acceleration (n, 3) in m/s^2 at times (n,): amplitude-modulated tones, each axis with its own phases."""
    chance = np.random.Generator(np.random.PCG64(0))
    result = np.zeros((len(times_s), 3))
    for hertz in TONES_HZ:
        swells = 1 + 0.5 * np.sin(2 * np.pi * chance.uniform(0.5, 2) * times_s + chance.uniform(0, 6))
        for axis in range(3):
            result[:, axis] += swells * np.sin(2 * np.pi * hertz * times_s + chance.uniform(0, 6))
    return result
