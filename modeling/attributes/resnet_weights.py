"""Weights of ResNet-50 from a file: identified by SHA-256, never executed, refused where they are not whole."""

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
"""torchvision's files, under download.pytorch.org/models; the digits begin the SHA-256 of each."""
HEADED = re.compile(r".*-([0-9a-f]{8})\.pth")
PICKLED, PLAIN = (".pth", ".pt"), (".safetensors",)
COUNTED = "num_batches_tracked"
"""Ends the names of what is counted in training alone: older files lack it."""
SEED = 0


@dataclass(frozen=True)
class Weights:
    """Which weights ResNet-50 is to have: those of a file that had this SHA-256, or random ones of a seed."""

    path: Path | None = None
    sha256: str = ""
    seed: int = SEED

    @property
    def description(self) -> str:
        """For reports: which they are."""
        if self.path is None:
            return f"random (He normal, seed {self.seed}): no file of pretrained weights was given"
        return f"{self.path.name}, SHA-256 {self.sha256}"

    @property
    def key(self) -> str:
        """What decides them, in a word."""
        return self.sha256 or f"random {self.seed}"

    def state(self) -> dict[str, Tensor]:
        """The weights, by torchvision's names. Raises MaterialError on a file that has changed or cannot be used."""
        if self.path is None:
            from palpate.modeling.attributes.resnet import random_state

            return random_state(self.seed)
        return read_weights(self.path, self.sha256)


@dataclass(frozen=True)
class _Refused:
    """Says of a file what is wrong with it."""

    path: Path

    def __call__(self, what: str) -> MaterialError:
        expected = f"torchvision's ResNet-50 is expected, as {PUBLISHED['IMAGENET1K_V1']}"
        return MaterialError(f"{self.path}: {what}; {expected}")


def weights_from(path: Path | None, sha256: str | None = None, seed: int = SEED) -> Weights:
    """The weights in a file (.pth or .safetensors), or random ones where there is none; the file is hashed, not read.

    `sha256` is demanded of the file where it is given; where a .pth carries eight digits of it in its name, as
    torchvision's do, these are. Raises MaterialError where it is another, or cannot be read.
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
    """Return the state of ResNet-50 in the file, all entries there, of the right shape, finite, as 32-bit floats.

    A .pth is read with torch's `weights_only`, which makes nothing but tensors. Raises MaterialError.
    """
    if _sha256(path) != sha256:
        raise MaterialError(f"{path}: it has changed since it was chosen; start again")
    import torch
    from safetensors.torch import load_file

    refused, is_pickled = _Refused(path), path.suffix.lower() in PICKLED
    try:
        state: Any = torch.load(path, map_location="cpu", weights_only=True) if is_pickled else load_file(path)
    except Exception as error:  # damaged bytes come out of zip, pickle and torch as anything
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
    """Yield each entry that the network has, checked, in its order."""
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
    needed = [name for name in expected if not name.endswith(COUNTED)]
    lacks = [name for name in needed if name not in state]
    foreign = [str(name) for name in state if name not in expected]
    if lacks or foreign:
        reasons = [f"{len(lacks)} of {len(needed)} tensors lack ({lacks[0]} first)"] if lacks else []
        reasons += [f"{len(foreign)} are no part of it ({foreign[0]} first)"] if foreign else []
        raise refused(", and ".join(reasons))


def _sound(name: str, tensor: Tensor, refused: Callable[[str], MaterialError]) -> Tensor:
    import torch

    if not bool(torch.isfinite(tensor).all()):
        raise refused(f"{name} holds a number that is not finite in 32 bits")
    if name.endswith("running_var") and bool((tensor < 0).any()):
        raise refused(f"{name} holds a variance below 0")
    return tensor
