"""A recording whose level and resonance follow speed and force, made by a stable recursion: quick to learn from."""

import numpy as np

from palpate.modeling.textures.recording import Parts, Recording


def recording(seconds=4.0, seed=3, texture="made_up"):
    chance = np.random.Generator(np.random.PCG64(seed))
    n = round(seconds * 1000)
    time = np.arange(n) / 1000
    speed = 80 + 60 * np.sin(2 * np.pi * 0.7 * time)
    force = 1 + 0.6 * np.sin(2 * np.pi * 0.45 * time + 1)
    level = 0.02 * speed * np.sqrt(force)
    angle = 2 * np.pi * (60 + 0.8 * speed) / 1000
    signal = np.zeros(n)
    noise = chance.standard_normal(n)
    for at in range(2, n):
        signal[at] = 1.88 * np.cos(angle[at]) * signal[at - 1] - 0.8836 * signal[at - 2] + 0.3 * level[at] * noise[at]
    return Recording(texture, texture, np.stack([signal, speed, force]))


def parts(whole, frames=10):
    size = whole.signals.shape[1] // frames
    cut = [(index * size, (index + 1) * size) for index in range(frames)]
    return Parts(tuple(cut[:7]), tuple(cut[7:9]), tuple(cut[9:]))
