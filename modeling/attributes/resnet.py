"""ResNet-50 with torchvision's names and shapes, and its average pool as features of patches (thesis 3.4.2).

He, Zhang, Ren, Sun, Deep residual learning for image recognition, 2016. As in torchvision's `resnet50`, for which
published weights were trained, the stride of a bottleneck is in its 3 x 3 convolution (version 1.5).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from palpate.analysis.features.pictures import Gray
from palpate.modeling.training.seeding import seeded

FEATURES, CLASSES = 2048, 1000
BLOCKS = (3, 4, 6, 3)
"""The number of bottlenecks in each of the four layers."""
WIDTHS = (64, 128, 256, 512)
WIDENS = 4
"""The ratio of a bottleneck's output channels to its width."""
IMAGENET_MEAN, IMAGENET_SD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
"""Mean and SD of each colour in the training of published weights."""
BATCH = 7
"""Patches per batch: a row of the grid. Fixed, since another number may change the rounding."""


class Bottleneck(nn.Module):
    """A bottleneck: relu(x + conv1x1(relu(conv3x3(relu(conv1x1(x)))))), each convolution with batch normalisation."""

    def __init__(self, inputs: int, width: int, stride: int = 1) -> None:
        super().__init__()
        outputs = width * WIDENS
        self.conv1 = nn.Conv2d(inputs, width, 1, bias=False)
        self.bn1: nn.Module = nn.BatchNorm2d(width)
        self.conv2 = nn.Conv2d(width, width, 3, stride, padding=1, bias=False)
        self.bn2: nn.Module = nn.BatchNorm2d(width)
        self.conv3 = nn.Conv2d(width, outputs, 1, bias=False)
        self.bn3: nn.Module = nn.BatchNorm2d(outputs)
        self.downsample: nn.Sequential | None = None
        if stride != 1 or inputs != outputs:
            self.downsample = nn.Sequential(nn.Conv2d(inputs, outputs, 1, stride, bias=False), nn.BatchNorm2d(outputs))

    def forward(self, x: Tensor) -> Tensor:
        """Return (batch, 4 x width, rows, columns) of (batch, inputs, rows, columns); a stride of 2 halves both."""
        inner = torch.relu(self.bn1(self.conv1(x)))
        inner = torch.relu(self.bn2(self.conv2(inner)))
        shortcut = x if self.downsample is None else self.downsample(x)
        return torch.relu(self.bn3(self.conv3(inner)) + shortcut)


class ResNet50(nn.Module):
    """ResNet-50: 25,557,032 parameters in a state of 320 entries with torchvision's names."""

    def __init__(self) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(3, 64, 7, stride=2, padding=3, bias=False)
        self.bn1: nn.Module = nn.BatchNorm2d(64)
        self.maxpool = nn.MaxPool2d(3, stride=2, padding=1)
        self.layer1 = _layer(64, 0)
        self.layer2 = _layer(256, 1, stride=2)
        self.layer3 = _layer(512, 2, stride=2)
        self.layer4 = _layer(1024, 3, stride=2)
        self.fc = nn.Linear(FEATURES, CLASSES)

    def pooled(self, x: Tensor) -> Tensor:
        """Return the average pool (batch, 2048) of normalised colours (batch, 3, rows, columns)."""
        x = self.maxpool(torch.relu(self.bn1(self.conv1(x))))
        x = self.layer4(self.layer3(self.layer2(self.layer1(x))))
        return x.mean(dim=(2, 3))

    def forward(self, x: Tensor) -> Tensor:
        """Return the scores of ImageNet's classes (batch, 1000) for normalised colours (batch, 3, rows, columns)."""
        scores: Tensor = self.fc(self.pooled(x))
        return scores


def _layer(inputs: int, place: int, stride: int = 1) -> nn.Sequential:
    width = WIDTHS[place]
    further = (Bottleneck(width * WIDENS, width) for _ in range(BLOCKS[place] - 1))
    return nn.Sequential(Bottleneck(inputs, width, stride), *further)


def random_state(seed: int) -> dict[str, Tensor]:
    """Return initial weights from a seed, as torchvision: He's normal distribution by fan-out for convolutions.

    Batch normalisation is the identity (running mean 0, variance 1).
    """

    def initialised() -> ResNet50:
        network = ResNet50()
        for layer in network.modules():
            if isinstance(layer, nn.Conv2d):
                nn.init.kaiming_normal_(layer.weight, mode="fan_out", nonlinearity="relu")
        return network

    state: dict[str, Tensor] = seeded(initialised, seed).state_dict()
    return state


def load_network(state: Mapping[str, Tensor]) -> ResNet50:
    """Return the network with these weights, in evaluation mode."""
    with torch.device("meta"):
        network = ResNet50()
    network.load_state_dict(dict(state), assign=True)
    network.eval()
    return network


def fold_batch_norms(network: ResNet50) -> ResNet50:
    """Fold each batch normalisation into its convolution, in place; return the network, which can no longer be trained.

    Computed in float64 and stored in float32. The pool changes by less than 1e-6 of its largest number.
    """
    for layer in network.modules():
        if not isinstance(layer, ResNet50 | Bottleneck):
            continue
        for number in (1, 2, 3):
            norm = getattr(layer, f"bn{number}", None)
            if isinstance(norm, nn.BatchNorm2d):
                setattr(layer, f"conv{number}", _fused(getattr(layer, f"conv{number}"), norm))
                setattr(layer, f"bn{number}", nn.Identity())
        if isinstance(layer, Bottleneck) and layer.downsample is not None:
            layer.downsample = nn.Sequential(_fused(*layer.downsample))
    layout: dict[str, Any] = {"memory_format": torch.channels_last}
    network.to(**layout)
    return network


def _fused(conv: nn.Module, norm: nn.Module) -> nn.Module:
    fuse: Callable[..., nn.Module] = fuse_conv_bn_eval
    return fuse(conv.double(), norm.double()).float()


def colours(patches: Gray) -> Tensor:
    """Return brightness (n, rows, columns) of 0 to 1 as three equal channels (n, 3, ...), normalised as ImageNet's."""
    gray = torch.from_numpy(np.ascontiguousarray(patches, dtype=np.float32))[:, None]
    mean, sd = torch.tensor(IMAGENET_MEAN)[:, None, None], torch.tensor(IMAGENET_SD)[:, None, None]
    return ((gray - mean) / sd).contiguous(memory_format=torch.channels_last)


def pool_of_patches(network: ResNet50, patches: Gray) -> NDArray[np.float32]:
    """Return the mean (2048,) over patches (n, 224, 224) of the network's average pool (thesis 3.4.2)."""
    total = np.zeros(FEATURES)
    with torch.inference_mode():
        for first in range(0, len(patches), BATCH):
            rows = network.pooled(colours(patches[first : first + BATCH]))
            total += rows.numpy().astype(np.float64).sum(axis=0)
    return (total / len(patches)).astype(np.float32)
