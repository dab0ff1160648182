"""The visuo-tactile network (thesis 3.5): HV-Net for pictures, HT-Net for touch, and the layers that join them.

Either of the two also predicts by itself."""

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
"""One picture is made anew in this share of the batches, drawn: their rows come in a drawn order, so that any of them
stands for all, and the decoder is nearly half of what HV-Net costs."""
OWN = 0.5
"""The weight of the RMSE of what each branch answers by itself, beside that of both together. Without it touch, which
tells the training textures apart soonest, leaves the picture little to explain (docs/reference/attribute-models.md)."""
OUT = 0.02
"""The last layer begins with a tenth of the others' SD, so that the first answers lie near the mean rating."""
LEAST = 1e-12
"""Added below the root, whose slope at nothing has no end."""


class Answer(NamedTuple):
    """Scaled attributes (batch, segments, attributes); how far the reconstruction is off (1,), 0 where none was made;
    in training what each of two branches says by itself (batch, 1 or segments, attributes)."""

    attributes: Tensor
    wrong: Tensor
    own: tuple[Tensor, ...] = ()


class VisuoTactile(nn.Module):
    """A picture and some segments of touch a row to scaled attributes, one for each segment.

    128 numbers of either branch, side by side; 128, 128 with ReLU; the greater of every two; 32 with ReLU; one linear
    unit for each attribute. Without `sight` or without `touch` the other branch has the same head for itself.
    Where there are both, each has a linear head of its own beside, which only training asks (deep supervision, Lee et
    al. 2015). A picture goes through HV-Net once, whatever the number of segments that it is shown with.

    `literal` is the thesis to the letter: HV-Net's dense layers follow the reconstruction, no branch has a head of its
    own, and the loss is the RMSE of the attributes alone.
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

    def forward(self, *given: Tensor) -> Answer:
        """(batch, features) of pictures, (batch, segments, steps, channels, places) of touch: those that it looks at.

        In evaluation mode the segments' answers are averaged and the reconstruction is not computed: what is
        watched is the attributes alone. Raises MaterialError for other shapes.
        """
        sight, touch = self._split_inputs(given)
        parts, wrong = [], given[0].new_zeros(1)
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
        """Join the branches' embeddings, (batch, 1 or segments, 128) each, into (batch, segments, attributes)."""
        count = max(part.shape[1] for part in parts)
        x = torch.cat([part.expand(-1, count, -1) for part in parts], dim=2)
        for layer in self.joined:
            x = torch.relu(layer(x))
        x = torch.relu(self.last(functional.max_pool1d(x, 2)))
        result: Tensor = self.out(x)
        return result

    def _split_inputs(self, given: tuple[Tensor, ...]) -> tuple[Tensor | None, Tensor | None]:
        """Return the pictures and the segments among the inputs; None for a branch that the network does not have."""
        expected = [dims for dims, branch in ((2, self.sight), (5, self.touch)) if branch is not None]
        if [tensor.ndim for tensor in given] != expected or len({len(tensor) for tensor in given}) != 1:
            shapes = ", ".join(str(tuple(tensor.shape)) for tensor in given)
            raise MaterialError(
                f"a network was given {shapes}: as many rows each, with {expected} dimensions, is expected."
            )
        left = list(given)
        sight = left.pop(0) if self.sight is not None else None
        return sight, left.pop(0) if self.touch is not None else None


def rmse(answer: Answer, target: Tensor) -> Tensor:
    """Return the root mean square error of scaled attributes, target (batch, attributes), with the terms of the
    reconstruction and of what each branch says by itself."""
    own = sum(_off(branch, target) for branch in answer.own)
    return _off(answer.attributes, target) + OWN * own + REBUILDING * answer.wrong.mean()


def _off(attributes: Tensor, target: Tensor) -> Tensor:
    return torch.sqrt((attributes - target[:, None]).square().mean() + LEAST)
