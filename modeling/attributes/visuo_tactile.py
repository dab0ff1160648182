"""The visuo-tactile network (thesis 3.5): HV-Net for pictures, HT-Net for touch, and the layers that join them.

It can also have one of the two branches alone."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.attributes.ht_net import HTNet
from palpate.modeling.attributes.hv_net import DENSE, HVNet
from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.row_layers import dense

EMBEDDED = DENSE[-1]
HIDDEN = (128, 128)
LAST = 32
REBUILDING = 0.1
"""The weight of the reconstruction's mean square error, in SDs of the features, beside the RMSE of the attributes."""
REBUILT = 0.5
"""The share of batches, drawn at random, with a reconstruction, of their first picture alone. Rows are in random order,
so any picture represents the batch, and the decoder takes nearly half of HV-Net's time."""
OWN = 0.5
"""The weight of the RMSE of each branch's own prediction, beside that of both together. Without it touch, which
separates the training textures first, leaves pictures little to explain (docs/reference/attribute-models.md)."""
OUT = 0.02
"""The gain of the last layer: a tenth of the others' initial SD, so that first predictions are near the mean rating."""
LEAST = 1e-12
"""Added under the square root, whose gradient at 0 is infinite."""


class Answer(NamedTuple):
    """The output of the network: scaled attributes (batch, segments, attributes); the reconstruction's mean square
    error (1,), 0 without one; in training, each branch's own prediction (batch, 1 or segments, attributes)."""

    attributes: Tensor
    wrong: Tensor
    own: tuple[Tensor, ...] = ()


class VisuoTactile(nn.Module):
    """The visuo-tactile network: a picture and segments of touch per row to scaled attributes for each segment.

    The branches' embeddings of 128 side by side; 128, 128 with ReLU; max pooling of 2; 32 with ReLU; one linear unit
    per attribute. Without `sight` (number of features) or `touch` (number of channels) the other branch has the same
    head. With both, each branch also has its own linear head, for training alone (deep supervision, Lee et al. 2015).
    A picture is computed once for all of its segments.

    `literal` follows the thesis to the letter: HV-Net's dense layers follow the reconstruction, branches have no heads
    of their own, and the loss is the RMSE of the attributes alone. Raises MaterialError without either branch.
    """

    def __init__(self, sight: int | None, touch: int | None, attributes: int = 4, literal: bool = False) -> None:
        super().__init__()
        if sight is None and touch is None:
            raise MaterialError("a network that neither sees nor feels has nothing to go by: name features of one.")
        self.literal = literal
        self.sight = None if sight is None else HVNet(sight, after_reconstruction=literal)
        self.touch = None if touch is None else HTNet(touch)
        branches = sum(branch is not None for branch in (sight, touch))
        sizes = (branches * EMBEDDED, *HIDDEN)
        self.joined = nn.ModuleList(dense(*pair) for pair in pairwise(sizes))
        self.last = dense(HIDDEN[-1] // 2, LAST)
        self.out = dense(LAST, attributes, gain=OUT)
        heads = branches if branches > 1 and not literal else 0
        self.own = nn.ModuleList(dense(EMBEDDED, attributes, gain=OUT) for _ in range(heads))

    def forward(self, *inputs: Tensor) -> Answer:
        """Return the attributes of pictures (batch, features) and touch (batch, segments, steps, channels, places).

        The inputs are those of the network's branches. In evaluation mode the segments' predictions are averaged, and
        the reconstruction is not computed, since the held-out loss is that of the attributes. Raises MaterialError for
        other shapes.
        """
        sight, touch = self._split_inputs(inputs)
        parts, wrong = [], inputs[0].new_zeros(1)
        if self.sight is not None and sight is not None:
            code = self.sight.encode(sight)
            parts.append(self.sight.embed(code)[:, None])
            if self.training and not self.literal and torch.rand(()) < REBUILT:
                wrong = (self.sight.decode(code[:1]) - sight[:1]).square().mean(dim=1)
        if self.touch is not None and touch is not None:
            parts.append(self.touch(touch.flatten(0, 1)).unflatten(0, touch.shape[:2]))
        answered = self.head(parts)
        if not self.training:
            return Answer(answered.mean(dim=1, keepdim=True), wrong)
        return Answer(answered, wrong, tuple(head(part) for head, part in zip(self.own, parts, strict=False)))

    def head(self, parts: list[Tensor]) -> Tensor:
        """Return attributes (batch, segments, attributes) of the branches' embeddings (batch, 1 or segments, 128)."""
        count = max(part.shape[1] for part in parts)
        x = torch.cat([part.expand(-1, count, -1) for part in parts], dim=2)
        for layer in self.joined:
            x = torch.relu(layer(x))
        x = torch.relu(self.last(functional.max_pool1d(x, 2)))
        result: Tensor = self.out(x)
        return result

    def _split_inputs(self, inputs: tuple[Tensor, ...]) -> tuple[Tensor | None, Tensor | None]:
        """Return the pictures and segments of the inputs; None for a missing branch. Raises MaterialError."""
        expected = [dims for dims, branch in ((2, self.sight), (5, self.touch)) if branch is not None]
        if [tensor.ndim for tensor in inputs] != expected or len({len(tensor) for tensor in inputs}) != 1:
            shapes = ", ".join(str(tuple(tensor.shape)) for tensor in inputs)
            raise MaterialError(
                f"a network was given {shapes}: as many rows each, with {expected} dimensions, is expected."
            )
        left = list(inputs)
        sight = left.pop(0) if self.sight is not None else None
        return sight, left.pop(0) if self.touch is not None else None


def rmse(answer: Answer, target: Tensor) -> Tensor:
    """Return the RMSE of scaled attributes against the target (batch, attributes), plus the weighted terms of the
    reconstruction and of each branch's own prediction."""
    own = sum(_attribute_rmse(branch, target) for branch in answer.own)
    return _attribute_rmse(answer.attributes, target) + OWN * own + REBUILDING * answer.wrong.mean()


def _attribute_rmse(attributes: Tensor, target: Tensor) -> Tensor:
    """Return the RMSE of (batch, segments, attributes) against (batch, attributes)."""
    return torch.sqrt((attributes - target[:, None]).square().mean() + LEAST)
