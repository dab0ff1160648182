"""Weights of ResNet-50 from a file: identified by SHA-256, never executed, refused where they are incomplete."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.modeling.attributes.material import MaterialError
from palpate.protocols.files import file_sha256

if TYPE_CHECKING:
    from torch import Tensor

PUBLISHED = {"IMAGENET1K_V1": "resnet50-0676ba61.pth", "IMAGENET1K_V2": "resnet50-11ad3fa6.pth"}
"""torchvision's files at download.pytorch.org/models; their names have the first digits of their SHA-256."""
HEADED = re.compile(r".*-([0-9a-f]{8})\.pth")
PICKLED, PLAIN = (".pth", ".pt"), (".safetensors",)
COUNTED = "num_batches_tracked"
"""The ending of counters of the training, which older files do not have."""
SEED = 0


@dataclass(frozen=True)
class Weights:
    """The weights of ResNet-50: of a file with this SHA-256, or random ones from a seed."""

    path: Path | None = None
    sha256: str = ""
    seed: int = SEED

    @property
    def description(self) -> str:
        """The weights' description for reports."""
        if self.path is None:
            return f"random (He normal, seed {self.seed}): no file of pretrained weights was given"
        return f"{self.path.name}, SHA-256 {self.sha256}"

    @property
    def key(self) -> str:
        """The weights' identity for a cache key."""
        return self.sha256 or f"random {self.seed}"

    def state(self) -> dict[str, Tensor]:
        """Return the weights by torchvision's names. Raises MaterialError for a changed or unusable file."""
        if self.path is None:
            from palpate.modeling.attributes.resnet import random_state

            return random_state(self.seed)
        return read_weights(self.path, self.sha256)


@dataclass(frozen=True)
class _Refused:
    """A function that makes an error of a file from a description of its fault."""

    path: Path

    def __call__(self, what: str) -> MaterialError:
        expected = f"torchvision's ResNet-50 is expected, as {PUBLISHED['IMAGENET1K_V1']}"
        return MaterialError(f"{self.path}: {what}; {expected}")


def weights_from(path: Path | None, sha256: str | None = None, seed: int = SEED) -> Weights:
    """Return the weights of a file (.pth, .pt or .safetensors), which is only hashed, or without a file random ones.

    The file's SHA-256 must be `sha256`, if that is given, and begin with the eight digits in the name of a .pth, as in
    torchvision's. Raises MaterialError where it is not, or the file cannot be read.
    """
    if path is None:
        return Weights(seed=seed)
    if path.suffix.lower() not in (*PICKLED, *PLAIN):
        raise MaterialError(f"{path}: weights are files named .pth, .pt or .safetensors")
    digest = _sha256(path)
    headed = HEADED.fullmatch(path.name)
    for where, digits in (("demanded", (sha256 or "").lower()), ("in its name", headed[1] if headed else "")):
        if not digest.startswith(digits):
            raise MaterialError(
                f"{path}: its SHA-256 begins with {digest[:16]}, and {digits[:16]} is {where}: the file is damaged or"
                " another one; download it again"
            )
    return Weights(path, digest)


def read_weights(path: Path, sha256: str) -> dict[str, Tensor]:
    """Return the state of ResNet-50 in a file, as float32, complete, with the right shapes, and finite.

    A .pth is read with torch's `weights_only`, which creates only tensors. Raises MaterialError for any other file.
    """
    if _sha256(path) != sha256:
        raise MaterialError(f"{path}: it has changed since it was chosen; start again")
    import torch
    from safetensors.torch import load_file

    refused, is_pickled = _Refused(path), path.suffix.lower() in PICKLED
    try:
        state: Any = torch.load(path, map_location="cpu", weights_only=True) if is_pickled else load_file(path)
    except Exception as error:  # zip, pickle and torch raise various errors for damaged bytes
        what = "no plain weights can be read" if is_pickled else "no safetensors file, or damaged"
        why = f"{type(error).__name__}: {error}".splitlines()[0][:160]
        raise refused(f"{what} ({why})") from None
    return dict(_fitting(state, refused))


def _sha256(path: Path) -> str:
    try:
        return file_sha256(path)
    except OSError as error:
        raise MaterialError(f"{path}: cannot be read ({error.strerror}); a file of weights is expected") from None


def _fitting(state: Any, refused: Callable[[str], MaterialError]) -> Iterator[tuple[str, Tensor]]:
    """Yield the network's entries in its order. Raises `refused` for missing, foreign or invalid ones."""
    import torch

    from palpate.modeling.attributes.resnet import ResNet50

    with torch.device("meta"):
        expected = ResNet50().state_dict()
    if not isinstance(state, Mapping):
        raise refused(f"a {type(state).__name__} is found, no tensors by name")
    _demand_names(state, expected, refused)
    for name, like in expected.items():
        if name.endswith(COUNTED):
            yield name, torch.zeros_like(like, device="cpu")
            continue
        entry = state[name]
        if not isinstance(entry, torch.Tensor) or entry.shape != like.shape or not entry.is_floating_point():
            tensor = isinstance(entry, torch.Tensor)
            kind = f"{entry.dtype} of {tuple(entry.shape)}" if tensor else type(entry).__name__
            raise refused(f"{name} is {kind}, floats of {tuple(like.shape)} are expected")
        yield name, _sound(name, entry.detach().to(torch.float32).contiguous(), refused)


def _demand_names(
    state: Mapping[Any, Any], expected: Mapping[str, Tensor], refused: Callable[[str], MaterialError]
) -> None:
    """Raise `refused` for missing or foreign names."""
    needed = [name for name in expected if not name.endswith(COUNTED)]
    missing = [name for name in needed if name not in state]
    foreign = [str(name) for name in state if name not in expected]
    if missing or foreign:
        reasons = [f"{len(missing)} of {len(needed)} tensors lack ({missing[0]} first)"] if missing else []
        reasons += [f"{len(foreign)} are no part of it ({foreign[0]} first)"] if foreign else []
        raise refused(", and ".join(reasons))


def _sound(name: str, tensor: Tensor, refused: Callable[[str], MaterialError]) -> Tensor:
    """Return the tensor. Raises `refused` for numbers that are not finite, and for negative variances."""
    import torch

    if not bool(torch.isfinite(tensor).all()):
        raise refused(f"{name} holds a number that is not finite in 32 bits")
    if name.endswith("running_var") and bool((tensor < 0).any()):
        raise refused(f"{name} holds a variance below 0")
    return tensor
