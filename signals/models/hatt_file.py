"""Reading a texture of the Penn Haptic Texture Toolkit: an XML file of AR or ARMA models over speed and force.

The format is that of the toolkit's `Models_NAME.xml` (Culbertson, Lopez Delgado and Kuchenbecker 2014): a `modelSet`
with units, sample rate, `tri` (three model numbers from 1, a Delaunay triangulation over speed and force) and a `model`
for each point: `ARlsf`, for ARMA `MAlsf` and `gain`, `var` of the excitation, `speedMod` and `forceMod`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array
from palpate.signals.models.errors import ModelFileError, reading
from palpate.signals.xml_text import EntitiesDeclared, xml_root

LARGEST = 32 * 1024**2
"""Bytes of a file; those of the toolkit have at most half a million."""
MOST = 1000
"""Models of a texture, and triangles."""
HIGHEST = 60
"""Order."""
FURTHEST = 1e9
"""Of a speed, force, variance or gain: what is beyond is none."""
UNITS = {"AccelUnits": "m/s^2", "SpeedUnits": "mm/s", "ForceUnits": "N"}


@dataclass(frozen=True)
class Hatt:
    """What a file says.

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
    """Return what the file says, and its content. Raises ModelFileError: where, what was found, what is expected."""
    with reading(path):
        if not path.is_file():
            raise ModelFileError(f"{path}: there is no such file.")
        if (size := path.stat().st_size) > LARGEST:
            raise ModelFileError(f"{path}: {size} bytes; a texture of the toolkit has at most {LARGEST}.")
        content = path.read_bytes()
    try:
        return _said(_tree(content)), content
    except _Odd as odd:
        raise ModelFileError(f"{path}: {odd}. A texture of the Penn Haptic Texture Toolkit is expected.") from None


class _Odd(Exception):
    """What is not as it should be."""


def _tree(content: bytes) -> ElementTree.Element:
    try:
        root = xml_root(content)
    except UnicodeDecodeError:
        raise _Odd("it is no UTF-8 text") from None
    except EntitiesDeclared:
        raise _Odd("it declares entities, which models have no need of; it is not read") from None
    except (ElementTree.ParseError, ValueError) as error:
        raise _Odd(f"it is no XML ({error})") from None
    if root.tag != "modelSet":
        raise _Odd(f"it begins with <{root.tag[:40]}>; <modelSet> is expected")
    return root


def _said(root: ElementTree.Element) -> Hatt:
    for name, unit in UNITS.items():
        if (found := root.findtext(name, unit).strip()) != unit:
            raise _Odd(f"{name} is {found!r}; {unit!r} is expected")
    models = root.findall("model")
    if not 1 <= len(models) <= MOST:
        raise _Odd(f"{len(models)} models found; 1 to {MOST} are expected")
    if (stated := root.find("numMod")) is not None and _number(stated, "numMod") != len(models):
        raise _Odd(f"numMod is {stated.text}, and there are {len(models)} models")
    each = _ordered(models)
    averages = [model.find("MAlsf") is not None for model in each]
    whole = Hatt(
        material=root.findtext("material", "").strip() or "unnamed",
        rate_hz=_single(root, "SampleRate") if root.find("SampleRate") is not None else 1000.0,
        friction=_single(root, "mu") if root.find("mu") is not None else None,
        points=np.array([[_single(model, "speedMod"), _single(model, "forceMod")] for model in each]),
        ar=_rows(each, "ARlsf"),
        ma=_rows(each, "MAlsf") if any(averages) else np.zeros((len(each), 0)),
        variance=np.array([_single(model, "var") for model in each]),
        gain=np.array([_single(model, "gain") if any(averages) else 1.0 for model in each]),
        triangles=_triangles(root, len(each)),
    )
    _demand(whole)
    return whole


def _ordered(models: Sequence[ElementTree.Element]) -> list[ElementTree.Element]:
    """By number, if they have one: triangles name them."""
    numbers = [model.find("modNum") for model in models]
    if any(number is None for number in numbers):
        return list(models)
    stated = [_number(number, "modNum") for number in numbers if number is not None]
    if sorted(stated) != list(range(1, len(models) + 1)):
        raise _Odd(f"modNum does not count the models from 1 to {len(models)}")
    return [models[place] for place in np.argsort(stated)]


def _rows(models: Sequence[ElementTree.Element], name: str) -> Array:
    """Return (k, order), of each model as many."""
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


def _demand(hatt: Hatt) -> None:
    if hatt.rate_hz <= 0:
        raise _Odd(f"SampleRate is {hatt.rate_hz:g}")
    if hatt.variance.min() < 0 or hatt.points.min() < 0:
        raise _Odd("a variance, speed or force lies below 0")
    if (most := max(each.max() for each in (hatt.points, hatt.variance, np.abs(hatt.gain)))) > FURTHEST:
        raise _Odd(f"a speed, force, variance or gain is {most:g}; at most {FURTHEST:g} is expected")
    for name, rows in (("ARlsf", hatt.ar), ("MAlsf", hatt.ma)):
        if rows.size and not ((np.diff(rows, axis=1) > 0).all() and rows.min() > 0 and rows.max() < np.pi):
            raise _Odd(f"{name} does not rise from above 0 to below pi in every model, so it is not stable")


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
