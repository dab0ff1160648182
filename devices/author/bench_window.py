"""The real window on a virtual display, in a process of its own: `python -m` this module WIDTH HEIGHT COUNT."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from contextlib import closing

import numpy as np

from devices.author.bench import PX_PER_MM, root, screen_of, timed_moves
from devices.author.making import Array, maker_for
from devices.window.calibration import Calibration

PATIENCE_S = 300.0


def drawn_in_window(size: tuple[int, int], count: int) -> Array:
    """Seconds from a move of a slider until its door stands on a virtual display of that size, for `count` moves."""
    from devices.window.bench_display import virtual_display

    command = [sys.executable, "-m", "devices.author.bench_window", *map(str, (*size, count))]
    with virtual_display(*size) as display:
        scene = {**os.environ, "DISPLAY": display, "PYTHONPATH": str(root())}
        done = subprocess.run(command, env=scene, capture_output=True, check=True, timeout=PATIENCE_S)
    return np.array(json.loads(done.stdout))


def main(width: int, height: int, count: int, seed: int = 1) -> None:
    """Open the window, move its sliders, and print the seconds that each move took to be drawn and flipped."""
    from PIL import Image

    from devices.window.shell import open_shell

    screen, image = screen_of(maker_for(None), (width, height)), Image.new("RGB", (width, height))
    with closing(open_shell(Calibration((width, height), PX_PER_MM, 0, "never: a virtual display"), 0, True)) as shell:
        shell.show(image, screen.paint(image))
        taken = timed_moves(screen, lambda: shell.show(image, screen.paint(image)), count, seed)
    print(json.dumps(taken.tolist()))  # noqa: T201 - what the other process reads


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
