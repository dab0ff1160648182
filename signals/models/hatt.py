"""Textures of the Penn Haptic Texture Toolkit, read as models that run like all others.

The toolkit interpolates line spectral frequencies and the variance of the excitation within triangles over speed and
force; so does `Autoregression`, given the variance in place of the log SD. A moving average has no state here: such
models become autoregressions of a higher order with the same first autocorrelations.

The format is that of the toolkit's `Models_NAME.xml` (Culbertson, Lopez Delgado and Kuchenbecker 2014): a `modelSet`
with units, sample rate, `tri` (three model numbers from 1, a Delaunay triangulation over speed and force) and a `model`
for each point: `ARlsf`, for ARMA `MAlsf` and `gain`, `var` of the excitation, `speedMod` and `forceMod`.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array
from palpate.signals.linear_prediction import expanded, frequencies_of, predictor_of, stable_within
from palpate.signals.models.card import Activation, Affine, Card, Port, Reshape, Step, Texture, Weights
from palpate.signals.models.card_steps import Autoregression, Join, Keep, Part, Recall
from palpate.signals.models.errors import ModelFileError, reading
from palpate.signals.models.runtime import Model
from palpate.signals.xml_text import EntitiesDeclared, xml_root

RADIUS = 0.998
"""Greatest radius of a pole of a converted model, at any speed and force."""
DAMP = 0.995
PER = (100.0, 1.0)
HIGHER = 40
"""Order of the autoregression that replaces a moving average."""
FINER = 3
"""Number of parts that a triangle's side is divided into where there is a moving average."""
SPECTRUM = 2**12
"""Number of points on the unit circle at which a spectrum is evaluated."""
START_MM_S, START_N = 45.0, 0.8
"""Speed and force at which a texture begins (thesis 4.5.1)."""
WARM_UP = 1000
PEAK_SDS = 6.0
"""Greatest acceleration that is played, in SDs of the loudest point."""


Numbers: TypeAlias = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class _Points:
    """Points (k, 2) with error filters (k, order + 1) and variances (k,) of their innovations; triangles (t, 3)."""

    points: Array
    filters: Array
    variance: Array
    triangles: NDArray[np.int64]


def read_hatt(path: Path | str) -> Model:
    """Read a texture of the toolkit, `Models_NAME.xml`, as a model that continues a texture.

    An AR model is exact: frequencies and variance are interpolated as the toolkit does. An ARMA model is exact in its
    first 40 autocorrelations at each of its points, and at nine places of each triangle. Poles beyond a radius of 0.998
    are drawn in. Raises ModelFileError: a file that is missing, foreign or damaged, units other than m/s^2, mm/s and N,
    frequencies that are not those of a stable filter.
    """
    path = Path(path)
    hatt, content = read_hatt_file(path)
    try:
        points = _converted(hatt)
    except ModelFileError as error:
        raise ModelFileError(f"{path}: {error}") from None
    window = points.filters.shape[1] - 1
    damping = np.ones((3, window))
    damping[0] = RADIUS ** np.arange(window, 0, -1)
    tensors: Numbers = {
        "damping": damping, "points": points.points / PER,
        "frequencies": np.array([frequencies_of(expanded(filter_, RADIUS)) for filter_ in points.filters]),
        "variance": points.variance, "triangles": points.triangles,
    }  # fmt: skip
    return Model(_card(path, hatt, points, content, window), {**tensors, "start": _start(tensors, window)})


def _converted(hatt: Hatt) -> _Points:
    """Return the predictor of each point, with points added between them for a moving average.

    Raises ModelFileError.
    """
    fine = hatt if not hatt.ma.shape[1] else _finer(hatt)
    if not hatt.ma.shape[1]:
        filters, error = _error_filters(fine.ar), np.ones(len(fine.ar))
    else:
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            filters, error = _without_average(fine)
        if not (np.isfinite(filters).all() and (error >= 0).all()):
            raise ModelFileError("ARlsf and MAlsf of a model lie too near the edge of what is stable to be converted.")
    # All poles are drawn inside RADIUS: where one is not, its filter is damped again and again.
    damped = filters.copy()
    while (out := ~stable_within(damped, RADIUS)).any():
        damped[out] *= DAMP ** np.arange(damped.shape[1])
    return _Points(fine.points, damped, error * fine.variance, fine.triangles)


def _finer(hatt: Hatt) -> Hatt:
    """Return the model with every triangle divided into nine, the new points interpolated as the toolkit does."""
    known: dict[tuple[tuple[int, int], ...], int] = {}
    triangles = [
        [known.setdefault(place, len(known)) for place in small]
        for corners in hatt.triangles.tolist()
        for small in _nine(corners)
    ]
    shares = np.zeros((len(known), len(hatt.points)))
    for place, row in known.items():
        for corner, share in place:
            shares[row, corner] = share / FINER
    return replace(
        hatt, points=shares @ hatt.points, ar=shares @ hatt.ar, ma=shares @ hatt.ma, gain=shares @ hatt.gain,
        variance=shares @ hatt.variance, triangles=np.array(triangles),
    )  # fmt: skip


def _nine(corners: list[int]) -> Iterator[list[tuple[tuple[int, int], ...]]]:
    """Yield the nine small triangles of a large one; each corner is a tuple of (point, share in thirds)."""

    def at(i: int, j: int) -> tuple[tuple[int, int], ...]:
        together: dict[int, int] = {}
        for corner, share in zip(corners, (FINER - i - j, i, j), strict=True):
            together[corner] = together.get(corner, 0) + share
        return tuple(sorted((corner, share) for corner, share in together.items() if share))

    for i in range(FINER):
        for j in range(FINER - i):
            yield [at(i, j), at(i + 1, j), at(i, j + 1)]
            if i + j < FINER - 1:
                yield [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]


def _error_filters(frequencies: Array) -> Array:
    return np.concatenate([np.ones((len(frequencies), 1)), -predictor_of(frequencies.shape[1])(frequencies)], axis=1)


def _without_average(hatt: Hatt) -> tuple[Array, Array]:
    """Return error filters of a higher order without a moving average, and their errors for an excitation of variance
    1.

    By Levinson and Durbin, from the first autocorrelations.
    """
    spectra = [np.abs(np.fft.rfft(_error_filters(filter_), SPECTRUM)) ** 2 for filter_ in (hatt.ma, hatt.ar)]
    lags = np.fft.irfft(spectra[0] / spectra[1] * hatt.gain[:, None] ** 2)[:, : HIGHER + 1]
    filters = np.zeros_like(lags)
    filters[:, 0], error = 1, lags[:, 0].copy()
    for order in range(1, HIGHER + 1):
        across = (filters[:, :order] * lags[:, order:0:-1]).sum(axis=1)
        reflection = np.divide(-across, error, out=np.zeros_like(error), where=error > 0)
        filters[:, : order + 1] += reflection[:, None] * filters[:, order::-1]
        error *= 1 - reflection**2
    return filters, error


def _steps(window: int) -> tuple[Step, ...]:
    """Return the card's steps, which interpolate the variance before they take the log of the SD."""
    predictor = Autoregression(
        points="points", frequencies="frequencies", log_sd="variance", triangles="triangles", per=PER
    )
    log_sd = (Part(start=1, stop=2), Activation(function="log"), Affine(gain=0.5), Keep(kept="log_sd"))
    both = (Recall(kept="both"), Part(start=0, stop=1), Join(kept=("log_sd",)))
    return (Reshape(shape=(3, window)), Affine(gain="damping"), predictor, Keep(kept="both"), *log_sd, *both)


def _card(path: Path, hatt: Hatt, points: _Points, content: bytes, window: int) -> Card:
    # How much stronger than its innovations a predictor's signal is, by the energy of its response.
    gains = np.fft.irfft(1 / np.abs(np.fft.rfft(points.filters, SPECTRUM)) ** 2)[:, 0]
    levels = np.sqrt(points.variance * gains)
    name = "hatt-" + (re.sub(r"[^a-z0-9]+", "_", hatt.material.lower()).strip("_") or "texture")[:50]
    low, high = points.points.min(axis=0), points.points.max(axis=0)
    notes = ["read from the Penn Haptic Texture Toolkit; see its licence"]
    notes += [f"an ARMA model of orders {hatt.ar.shape[1]} and {hatt.ma.shape[1]}"] if hatt.ma.shape[1] else []
    notes += [f"kinetic friction {hatt.friction:g}, which is not rendered"] if hatt.friction is not None else []
    return Card(
        name=name, title=f"{hatt.material} (HaTT)", method="hatt", steps=_steps(window), notes=tuple(notes),
        weights=Weights(file=path.name, sha256=hashlib.sha256(content).hexdigest(), bytes=len(content)),
        takes=Port(kind="texture_window", size=3 * window, unit="m/s^2, mm/s, N"),
        gives=Port(kind="acceleration", size=2, unit="m/s^2"),
        texture=Texture(
            id=name, label=hatt.material, rate_hz=hatt.rate_hz, window=window, start="start",
            speed_mm_s=(float(low[0]), float(high[0])), force_N=(float(low[1]), float(high[1])),
            rms_m_s2=float(np.sqrt(np.mean(levels**2))), peak_m_s2=PEAK_SDS * max(float(levels.max()), 1e-3),
        ),
    )  # fmt: skip


def _start(tensors: Numbers, window: int) -> Array:
    """Return the acceleration (window,) that the model produces at 45 mm/s and 0.8 N after a warm-up."""
    silent = Weights(file="x", sha256="0" * 64, bytes=0)
    takes, gives = Port(kind="texture_window", size=3 * window, unit=""), Port(kind="acceleration", size=2, unit="")
    card = Card(name="x", title="", method="hatt", weights=silent, takes=takes, gives=gives, steps=_steps(window))
    hand = np.tile(np.repeat([START_MM_S, START_N], window), (window, 1))
    answers = Model(card, tensors).run(np.concatenate([np.eye(window), hand], axis=1))
    innovations = np.random.Generator(np.random.PCG64(0)).normal(size=WARM_UP) * np.exp(answers[0, 1])
    past = np.zeros(window)
    for innovation in innovations:
        past = np.append(past[1:], answers[:, 0] @ past + innovation)
    return past


LARGEST = 32 * 1024**2
"""Greatest size of a file in bytes; those of the toolkit have at most half a million."""
MOST = 1000
"""Greatest number of models of a texture; half the greatest number of triangles."""
HIGHEST = 60
"""Greatest order of a model."""
FURTHEST = 1e9
"""Greatest accepted speed, force, variance or gain."""
UNITS = {"AccelUnits": "m/s^2", "SpeedUnits": "mm/s", "ForceUnits": "N"}


@dataclass(frozen=True)
class Hatt:
    """The content of a model file of the Penn Haptic Texture Toolkit.

    points (k, 2): mm/s and N; `ar` (k, p) and `ma` (k, q), q may be 0: line spectral frequencies of the polynomials;
    `variance` (k,) of the excitation, `gain` (k,) of it and of the moving average; triangles (t, 3) from 0.
    """

    material: str
    rate_hz: float
    friction: float | None
    points: Array
    ar: Array
    ma: Array
    variance: Array
    gain: Array
    triangles: NDArray[np.int64]


def read_hatt_file(path: Path) -> tuple[Hatt, bytes]:
    """Return the parsed content of a file, and its bytes. Raises ModelFileError: where, what was found, what is
    expected.
    """
    with reading(path):
        if not path.is_file():
            raise ModelFileError(f"{path}: there is no such file.")
        if (size := path.stat().st_size) > LARGEST:
            raise ModelFileError(f"{path}: {size} bytes; a texture of the toolkit has at most {LARGEST}.")
        content = path.read_bytes()
    try:
        return _parsed(_tree(content)), content
    except _Odd as odd:
        raise ModelFileError(f"{path}: {odd}. A texture of the Penn Haptic Texture Toolkit is expected.") from None


class _Odd(Exception):
    """A problem of the file."""


def _tree(content: bytes) -> ElementTree.Element:
    try:
        root = xml_root(content)
    except UnicodeDecodeError:
        raise _Odd("it is not UTF-8 text") from None
    except EntitiesDeclared:
        raise _Odd("it declares entities, which models have no need of; it is not read") from None
    except (ElementTree.ParseError, ValueError) as error:
        raise _Odd(f"it is not XML ({error})") from None
    if root.tag != "modelSet":
        raise _Odd(f"it begins with <{root.tag[:40]}>; <modelSet> is expected")
    return root


def _parsed(root: ElementTree.Element) -> Hatt:
    for name, unit in UNITS.items():
        if (stated_unit := root.findtext(name, unit).strip()) != unit:
            raise _Odd(f"{name} is {stated_unit!r}; {unit!r} is expected")
    models = root.findall("model")
    if not 1 <= len(models) <= MOST:
        raise _Odd(f"{len(models)} models found; 1 to {MOST} are expected")
    if (stated := root.find("numMod")) is not None and _number(stated, "numMod") != len(models):
        raise _Odd(f"numMod is {stated.text}, and there are {len(models)} models")
    models = _ordered(models)
    averages = [model.find("MAlsf") is not None for model in models]
    hatt = Hatt(
        material=root.findtext("material", "").strip() or "unnamed",
        rate_hz=_single(root, "SampleRate") if root.find("SampleRate") is not None else 1000.0,
        friction=_single(root, "mu") if root.find("mu") is not None else None,
        points=np.array([[_single(model, "speedMod"), _single(model, "forceMod")] for model in models]),
        ar=_rows(models, "ARlsf"),
        ma=_rows(models, "MAlsf") if any(averages) else np.zeros((len(models), 0)),
        variance=np.array([_single(model, "var") for model in models]),
        gain=np.array([_single(model, "gain") if any(averages) else 1.0 for model in models]),
        triangles=_triangles(root, len(models)),
    )
    if hatt.rate_hz <= 0:
        raise _Odd(f"SampleRate is {hatt.rate_hz:g}")
    if hatt.variance.min() < 0 or hatt.points.min() < 0:
        raise _Odd("a variance, speed or force lies below 0")
    if (most := max(values.max() for values in (hatt.points, hatt.variance, np.abs(hatt.gain)))) > FURTHEST:
        raise _Odd(f"a speed, force, variance or gain is {most:g}; at most {FURTHEST:g} is expected")
    for name, rows in (("ARlsf", hatt.ar), ("MAlsf", hatt.ma)):
        if rows.size and not ((np.diff(rows, axis=1) > 0).all() and rows.min() > 0 and rows.max() < np.pi):
            raise _Odd(f"{name} does not rise from above 0 to below pi in every model, so it is not stable")
    return hatt


def _ordered(models: Sequence[ElementTree.Element]) -> list[ElementTree.Element]:
    """Return the models in the order of their numbers, which triangles refer to; unchanged if they have no numbers."""
    numbers = [model.find("modNum") for model in models]
    if any(number is None for number in numbers):
        return list(models)
    stated = [_number(number, "modNum") for number in numbers if number is not None]
    if sorted(stated) != list(range(1, len(models) + 1)):
        raise _Odd(f"modNum does not count the models from 1 to {len(models)}")
    return [models[place] for place in np.argsort(stated)]


def _rows(models: Sequence[ElementTree.Element], name: str) -> Array:
    """Return the frequencies (k, order) of this name. Raises _Odd unless all models have the same number of them."""
    rows = []
    for number, model in enumerate(models, start=1):
        element = model.find(name)
        if element is None:
            raise _Odd(f"model {number} has no {name}")
        rows.append([_number(value, f"{name} of model {number}") for value in element.findall("value")])
    sizes = {len(row) for row in rows}
    if len(sizes) > 1 or not 1 <= max(sizes) <= HIGHEST:
        raise _Odd(f"{name} has {sorted(sizes)} values; as many for all models, 1 to {HIGHEST}, are expected")
    return np.array(rows)


def _triangles(root: ElementTree.Element, count: int) -> NDArray[np.int64]:
    rows = [[_number(value, "tri") for value in tri.findall("value")] for tri in root.findall("tri")]
    if not rows and count == 1:
        rows = [[1, 1, 1]]
    if not 1 <= len(rows) <= 2 * MOST or any(len(row) != 3 for row in rows):
        raise _Odd(f"{len(rows)} triangles (tri) found; one at least, of three model numbers each, is expected")
    triangles = np.array(rows)
    if (triangles != np.round(triangles)).any() or triangles.min() < 1 or triangles.max() > count:
        raise _Odd(f"a triangle names a model that is not there; there are 1 to {count}")
    return triangles.astype(np.int64) - 1


def _single(parent: ElementTree.Element, name: str) -> float:
    element = parent.find(name)
    if element is None:
        raise _Odd(f"there is no {name} in a {parent.tag}")
    return _number(element, name)


def _number(element: ElementTree.Element, what: str) -> float:
    try:
        value = float(element.text or "")
    except ValueError:
        raise _Odd(f"{what} holds {(element.text or '')[:40]!r}; a number is expected") from None
    if not np.isfinite(value):
        raise _Odd(f"{what} holds {value}")
    return value
