"""Figures to reach for the designer's window: how soon a moved slider's door is drawn, and how accurately."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.devices.author.work import History, Setting, Work, neutral
from palpate.devices.door.making import Maker, maker_for
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.geometry import Box
from palpate.devices.window.plot import Axes, axes_for, line_mask
from palpate.protocols.bench import Case
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import MAX_ANGLE_DEG, POINTS, POINTS_PER_DEG

if TYPE_CHECKING:
    from palpate.devices.author.screen import DesignerScreen

SIZES = ((1280, 720), (1920, 1080))
PX_PER_MM = 3.78
MOVES, QUICK_MOVES = 1000, 150
AREA = "doors"
PATIENCE_S = 300.0


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of painting alone, of the real window on a virtual display, and of the line's error."""
    from benchmarks.window.display import missing

    count, maker = QUICK_MOVES if quick else MOVES, maker_for(None)
    for size in SIZES:
        input_name = f"{size[0]}x{size[1]}, {count} moves"
        yield _moves("painted, no window", input_name, count, partial(painted_s, maker, size, count))
        if not missing():
            yield _moves("window, framebuffer", input_name, count, partial(moves_in_window_s, size, count))
        error = partial(line_error_px, neutral_door(maker), size)
        yield Case(AREA, "drawn line", "mask", f"{size[0]}x{size[1]}, neutral door", POINTS, "px off", error, float, 1)


def _moves(method: str, input_name: str, n: int, run: Callable[[], Array]) -> Case:
    """Return a case whose run gives the seconds of each move."""
    return Case(AREA, "slider move to drawn profile", method, input_name, n, "ms p99", run, _p99_ms, 1)


def _p99_ms(seconds: Array) -> float:
    return 1e3 * float(np.percentile(seconds, 99))


def painted_s(maker: Maker, size: tuple[int, int], count: int, seed: int = 1) -> Array:
    """Return the seconds from each of `count` moves of a slider until its door is in the picture, without a window."""
    from PIL import Image

    screen, image = screen_of(maker, size), Image.new("RGB", size)
    screen.paint(image)
    return timed_moves(screen, lambda: screen.paint(image), count, seed)


def screen_of(maker: Maker, size: tuple[int, int]) -> DesignerScreen:
    """Return the screen of the sliders, every wish in the middle."""
    from palpate.devices.author.screen import DesignerScreen
    from palpate.devices.author.view import DesignerView, author_texts
    from palpate.devices.window.fonts import find_fonts
    from palpate.devices.window.geometry import Metrics
    from palpate.devices.window.screen import Page

    page = Page(Metrics(*size, PX_PER_MM), author_texts(), find_fonts())
    return DesignerScreen(page, DesignerView(page, maker), History(Work(neutral(len(maker.attributes)))))


def timed_moves(
    screen: DesignerScreen, draw: Callable[[], object], count: int, seed: int,
    clock: Callable[[], float] = time.perf_counter,
) -> Array:  # fmt: skip
    """Drag every slider in turn to random places, each a new door, and return the seconds of each move."""
    from palpate.devices.window.inputs import Moved, Pressed, Released

    chance, seconds = np.random.Generator(np.random.PCG64(seed)), np.empty(count)
    sliders = [screen.view.slider(screen.work, number) for number in range(len(screen.work.a.wish))]
    for move in range(count):
        slider = sliders[move * len(sliders) // count]
        x, y = slider.box.middle[0], slider.row(round(chance.uniform(0, 100)))
        if screen.held != slider.name:
            screen.handle(Released(x, y, 0.0))
            screen.handle(Pressed(x, slider.box.middle[1], 0.0))
            draw()
        start = clock()
        screen.handle(Moved(x, y, 0.0))
        draw()
        seconds[move] = clock() - start
    return seconds


def neutral_door(maker: Maker) -> Array:
    """Return the door with every wish in the middle."""
    wish = neutral(len(maker.attributes)).wish
    return np.asarray(maker.design(np.array(Setting(wish).wish)).force_N)


def line_error_px(force_N: Array, size: tuple[int, int], thick_px: float = 3.0) -> float:
    """Return the largest distance, in pixels across the line, between the drawn line's middle and the profile."""
    axes = axes_for(Box(0, 0, size[0] // 2, size[1] // 2), force_N)
    first, mask = line_mask(force_N, axes, thick_px)
    weight = mask.astype(np.float64)
    rows = first + (np.arange(len(mask))[:, None] * weight).sum(axis=0) / weight.sum(axis=0)
    true = exact_rows(force_N, axes)
    lean = np.sqrt(1 + np.gradient(true) ** 2)
    return float((np.abs(rows - true) / lean)[2:-2].max())


def exact_rows(force_N: Array, axes: Axes) -> Array:
    """Return the profile's row at the middle of every column."""
    angle = np.arange(axes.box.width) / (axes.box.width - 1) * MAX_ANGLE_DEG
    force = np.interp(angle * POINTS_PER_DEG, np.arange(POINTS), force_N)
    return np.asarray((axes.high_N - force) / (axes.high_N - axes.low_N) * (axes.box.height - 1))


def root() -> Path:
    """Return the folder of the packages."""
    return Path(__file__).resolve().parents[2]


def moves_in_window_s(size: tuple[int, int], count: int) -> Array:
    """Return the seconds from each of `count` moves of a slider until its door is on a virtual display of that size."""
    from benchmarks.window.display import virtual_display

    command = [sys.executable, "-m", "benchmarks.doors.designer_window", *map(str, (*size, count))]
    with virtual_display(*size) as display:
        scene = {**os.environ, "DISPLAY": display, "PYTHONPATH": str(root())}
        done = subprocess.run(command, env=scene, capture_output=True, check=True, timeout=PATIENCE_S)
    return np.array(json.loads(done.stdout))


def main(width: int, height: int, count: int, seed: int = 1) -> None:
    """Open the window, move its sliders, and print the seconds that each move took to be drawn and flipped."""
    from PIL import Image

    from palpate.devices.window.shell import open_shell

    screen, image = screen_of(maker_for(None), (width, height)), Image.new("RGB", (width, height))
    with closing(open_shell(Calibration((width, height), PX_PER_MM, 0, "never: a virtual display"), 0, True)) as shell:
        shell.show(image, screen.paint(image))
        seconds = timed_moves(screen, lambda: shell.show(image, screen.paint(image)), count, seed)
    print(json.dumps(seconds.tolist()))  # noqa: T201 - what the other process reads


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
