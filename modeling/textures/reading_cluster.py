"""The Cluster Haptic Texture Dataset (Eguchi, Hayase, Hiroi and Hiraki, arXiv 2407.16206; figshare 29438288).

A rubber finger slides over 118 surfaces, in eight directions, at five speeds and under two forces, twice. Its layout
and the checks are described in docs/reference/texture-data.md, Loaders.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.modeling.textures.preparing import Touched, prepared
from palpate.modeling.textures.rates import Sampled
from palpate.modeling.textures.recording import Recording, TextureDataError
from palpate.modeling.textures.table_columns import G_M_S2, read_columns
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.files import file_sha256
from palpate.protocols.wording import count, some

NAME = re.compile(r"(?P<texture>\d+)_(?P<direction>\d+)_(?P<velocity>\d+)_(?P<force>\d+)_(?P<repeat>\d+)")
"""Pattern of a file name: texture id, direction (degrees, clockwise), velocity (mm/s), force (mN), repeat."""
RATES_HZ = {"acceleration": 6000.0, "force": 6000.0, "position": 100.0}
FOLDERS = {"acceleration": "accel", "force": "force", "position": "position"}
COLUMNS = {"acceleration": ("x", "y", "z"), "force": ("force",), "position": ("x", "y")}
HEADERS = {"acceleration": "time,X,Y,Z", "force": "time,force", "position": "time,X,Y"}
RATE_OFF = 0.1
"""The greatest relative deviation of a time column's mean rate from the documented one."""
GRAVITY_G = (0.5, 1.5)
"""Range of the median magnitude of acceleration, which includes gravity."""
FORCE_OFF, SPEED_OFF = 4.0, 2.0
"""The greatest ratio, either way, of force and speed to the values in a file's name."""


@dataclass(frozen=True)
class Slide:
    """One recorded slide, described by its file name."""

    root: Path
    stem: str
    direction_deg: int
    velocity_mm_s: float
    force_N: float
    files: dict[str, Path]


def read_cluster(
    folder: Path, textures: Sequence[str] = (), *, remove_hum: bool = True
) -> tuple[Recording, ...]:  # fmt: skip
    """Return the textures of the data set in a folder, by number; each slide is a piece of its texture's recording.

    `folder` holds sensor_data/accel, force and position (or these three). `textures` are names such as cluster_0, by
    default all. Raises TextureDataError for a file that is missing or cut short, an undocumented rate, unit, speed or
    force, and signals that no texture can be learned from.
    """
    return tuple(
        prepared(texture, texture.replace("_", " "), (touched(exploration) for exploration in every), remove_hum)
        for texture, every in slides(folder, textures).items()
    )


def slides(folder: Path, textures: Sequence[str] = ()) -> dict[str, list[Slide]]:
    """Return the slides of each texture (cluster_0), ordered by texture, direction and speed, without reading them.

    Raises TextureDataError where there is none, or none of a requested texture, or where a file of one is missing.
    """
    accel = _accel(folder)
    result: dict[str, list[Slide]] = {}
    for name, match, file in _named(accel):
        if textures and name not in textures:
            continue
        root = accel.parent
        files = {what: root / signal / file.relative_to(accel) for what, signal in FOLDERS.items()}
        if absent := [path for path in files.values() if not path.is_file()]:
            raise TextureDataError(f"{absent[0]}: no such file; every slide has one in accel, force and position")
        velocity, force = float(match["velocity"]), 1e-3 * float(match["force"])
        slide = Slide(root, match[0], int(match["direction"]), velocity, force, files)
        result.setdefault(name, []).append(slide)
    missing = [name for name in textures if name not in result]
    if missing:
        raise TextureDataError(f"{folder}: no slide over the texture {missing[0]!r}; {nearest(missing[0], result)}")
    if not result:
        raise _nothing(accel)
    return result


def names_in(folder: Path) -> list[str]:
    """Return the textures with a slide, complete or not. Raises TextureDataError where there is none."""
    accel = _accel(folder)
    result = list(dict.fromkeys(name for name, _, _ in _named(accel)))
    if not result:
        raise _nothing(accel)
    return result


def touched(slide: Slide) -> Touched:
    """Return the sensors' signals of one slide, in m/s^2, N and mm. Raises TextureDataError as `read_cluster` does."""
    acceleration, force, position = (_sampled(slide, what) for what in FOLDERS)
    length = float(np.median(np.linalg.norm(acceleration.values, axis=1)))
    low, high = GRAVITY_G
    if not low <= length <= high:
        raise TextureDataError(
            f"{acceleration.where}: the acceleration's median length is {length:.3g}; about 1 is expected, as gravity"
            " is in it: is it in g?"
        )
    pressed = abs(float(np.median(force.values)))
    if not slide.force_N / FORCE_OFF <= pressed <= slide.force_N * FORCE_OFF:
        raise TextureDataError(
            f"{force.where}: the median force is {pressed:.3g}, and the file's name has {slide.force_N:g} N: is it in"
            " N?"
        )
    # the speed of the finger while it moves
    steps = np.linalg.norm(np.diff(position.values, axis=0), axis=1) * position.rate_hz
    moving = steps[steps > 0.1 * steps.max(initial=0.0)]
    speed = float(np.median(moving)) if moving.size else 0.0
    if not slide.velocity_mm_s / SPEED_OFF <= speed <= slide.velocity_mm_s * SPEED_OFF:
        raise TextureDataError(
            f"{position.where}: the finger moves at {speed:.3g} mm/s, and the file's name says"
            f" {slide.velocity_mm_s:g} mm/s: are the positions in mm?"
        )
    scaled = Sampled(
        "acceleration", acceleration.times_s, G_M_S2 * acceleration.values, acceleration.rate_hz, acceleration.where,
        acceleration.written_s,
    )  # fmt: skip
    made_from = tuple(f"{file.parent.name}/{file.name} {file_sha256(file)}" for file in slide.files.values())
    text = f"Cluster Haptic Texture Dataset: {slide.velocity_mm_s:g} mm/s, {slide.force_N:g} N are wished for"
    return Touched(f"{slide.root}: {slide.stem}", scaled, force, position=position, made_from=made_from, notes=(text,))


def _accel(folder: Path) -> Path:
    root = folder / "sensor_data" if (folder / "sensor_data").is_dir() else folder
    accel = root / FOLDERS["acceleration"]
    if not accel.is_dir():
        raise TextureDataError(f"{folder}: no folder sensor_data/accel; the Cluster Haptic Texture Dataset is expected")
    return accel


def _nothing(accel: Path) -> TextureDataError:
    text = "no file named as 0_135_40_500_0.csv (texture_direction_velocity_force_repeat)"
    return TextureDataError(f"{accel}: {text}")


def _named(accel: Path) -> list[tuple[str, re.Match[str], Path]]:
    """Return each slide's texture, its parsed file name and its file, ordered by texture, direction and speed."""
    files = [(match, file) for file in accel.rglob("*.csv") if (match := NAME.fullmatch(file.stem))]
    files.sort(key=lambda entry: [int(number) for number in entry[0].groups()])
    return [(f"cluster_{match['texture']}", match, file) for match, file in files]


def _sampled(slide: Slide, what: str) -> Sampled:
    """Return a signal of a slide's table, at its own times."""
    file = slide.files[what]
    table = read_columns(file)
    missing = [name for name in ("time", *COLUMNS[what]) if name not in table.columns]
    if missing:
        raise TextureDataError(
            f"{file}: no column {missing[0]!r} among {some(table.header)}; {HEADERS[what]} is expected"
        )
    time = table.columns["time"]
    columns = [table.columns[name] for name in COLUMNS[what]]
    for column in (time, *columns):
        if column.empty.any():
            line = table.lines[int(np.flatnonzero(column.empty)[0])]
            raise TextureDataError(f"{file}, line {line}: an empty cell; is the file cut short?")
    # the mean rate of the time column must be about the documented one
    lasts = float(time.values[-1] - time.values[0]) if len(time.values) > 1 else 0.0
    if not lasts > 0 or (np.diff(time.values) < 0).any():
        raise TextureDataError(
            f"{file}: {count(len(time.values), 'sample')} whose times do not rise; two or more are needed"
        )
    rate_hz, documented_hz = (len(time.values) - 1) / lasts, RATES_HZ[what]
    if abs(rate_hz - documented_hz) > RATE_OFF * documented_hz:
        raise TextureDataError(
            f"{file}: {what} at {rate_hz:.4g} Hz by its times; {documented_hz:g} Hz are documented: are the times in"
            " seconds, and are all rows there?"
        )
    values = np.stack([column.values for column in columns], axis=1)
    return Sampled(what, time.values, values, rate_hz, str(file), time.written)
