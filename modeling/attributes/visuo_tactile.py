"""The visuo-tactile network (thesis 3.5): HV-Net for pictures, HT-Net for touch, and what joins them.

HV-Net is a convolutional autoencoder and two dense layers (3.5.1). HT-Net is six stacked ConvLSTM layers over places in
a row (3.5.2; Shi et al. 2015, without peepholes, as Keras' ConvLSTM1D). Either of the two also predicts by itself."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.attributes.material import MaterialError

SIGHT_FILTERS = (256, 256, 128, 64, 32)
KERNELS = (4, 4, 3, 3, 3)
DENSE = (512, 128)
LEAST_NORM = 2 ** len(SIGHT_FILTERS)
"""The shortest row that can be halved after each layer."""
KERNEL = 3
GAIN = 4.0
"""How much larger than Glorot's the weights from the input begin. A sigmoid times a tanh quarters a small signal; six
layers of it would hand over a 4000th, and nothing would be learned in the first hundreds of steps."""
TOUCH_FILTERS = (128, 256, 128, 128, 256, 128)
POOLED = (2, 4, 5)
"""The layers, counted from one, after which every two steps become one."""
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


class Seen(NamedTuple):
    """What HV-Net answers: 128 numbers a picture (batch, 128), and its features made anew (batch, length)."""

    embedded: Tensor
    rebuilt: Tensor


class Answer(NamedTuple):
    """Scaled attributes (batch, segments, attributes); how far the reconstruction is off (1,), 0 where none was made;
    in training what each of two branches says by itself (batch, 1 or segments, attributes)."""

    attributes: Tensor
    wrong: Tensor
    own: tuple[Tensor, ...] = ()


class RowConv(nn.Module):
    """(..., places, channels) to (..., places, filters), zeros beyond the ends.

    `weight` (filters, channels, kernel) and `bias` are, and begin as, those of torch's Conv1d. An even kernel sees one
    place more before than after.
    """

    def __init__(self, channels: int, filters: int, kernel: int, bias: bool = True) -> None:
        super().__init__()
        self.channels, self.filters, self.kernel = channels, filters, kernel
        plain = nn.Conv1d(channels, filters, kernel, bias=bias)
        self.weight, self.bias = plain.weight, plain.bias

    def forward(self, x: Tensor) -> Tensor:
        """Bring together what the kernel sees, and multiply; for one filter the other way round, which copies less."""
        if self.filters > 1:
            return functional.linear(neighbours(x, self.kernel), self.matrix(), self.bias)
        parts = _around(functional.linear(x, self.weight[0].T), self.kernel).unbind(-1)
        places = x.shape[-2]
        summed = torch.stack([part[..., tap : tap + places] for tap, part in enumerate(parts)]).sum(dim=0)[..., None]
        return summed if self.bias is None else summed + self.bias

    def matrix(self) -> Tensor:
        """Return the weights (filters, kernel x channels), as `neighbours` arranges a row."""
        return self.weight.transpose(1, 2).flatten(1)


class HVNet(nn.Module):
    """(batch, length) features of pictures to 128 numbers each, and to the features made anew.

    Encoder: five convolutions over the row of features, ReLU and a halving (max pooling 2) after each: of 2304 numbers
    (32, 72) is left, the code. Decoder: the same filters and kernels the other way round, ReLU and a doubling after
    each (to the length that was halved there, where it was odd), and one filter that joins 256 into the row.

    The dense layers 512 and 128 are given the code, and the row that is made anew stands in the loss. The thesis has
    them "after reconstruction": with `after_reconstruction` they are given that row; then ten layers stand between the
    features and the answer, and one channel. That way it errs more after the same training, and prediction needs the
    decoder (docs/reference/attribute-models.md has the numbers).

    Between the layers rows are (batch, places, filters), as `RowConv` takes them.
    """

    def __init__(self, length: int, after_reconstruction: bool = False) -> None:
        super().__init__()
        if length < LEAST_NORM:
            raise MaterialError(
                f"HV-Net halves a row {len(SIGHT_FILTERS)} times: {length} features, {LEAST_NORM} are expected."
            )
        self.length, self.after_reconstruction = length, after_reconstruction
        self.encoder = nn.ModuleList(map(_conv, (1, *SIGHT_FILTERS[:-1]), SIGHT_FILTERS, KERNELS))
        back = SIGHT_FILTERS[::-1]
        self.decoder = nn.ModuleList(map(_conv, (back[0], *back[:-1]), back, KERNELS[::-1]))
        self.join = _conv(back[-1], 1, KERNELS[0])
        inputs = length if after_reconstruction else SIGHT_FILTERS[-1] * (length // LEAST_NORM)
        self.first, self.second = dense(inputs, DENSE[0]), dense(*DENSE)

    def forward(self, rows: Tensor) -> Seen:
        """Encode, embed, rebuild. Raises MaterialError for rows of another length."""
        code = self.encode(rows)
        return Seen(self.embed(code), self.decode(code))

    def looked(self, rows: Tensor) -> Tensor:
        """(batch, length) to (batch, 128), without making the features anew where that is not needed."""
        return self.embed(self.encode(rows))

    def encode(self, rows: Tensor) -> Tensor:
        """(batch, length) to (batch, 32, length halved five times). Raises MaterialError for rows of another length."""
        if rows.ndim != 2 or rows.shape[1] != self.length:
            raise MaterialError(f"HV-Net came to {tuple(rows.shape)}: (batch, {self.length}) is expected.")
        x = rows[:, :, None]
        for layer in self.encoder:
            x = torch.relu(greater_of_two(layer(x)))  # the same as ReLU first
        return x.transpose(1, 2)

    def decode(self, code: Tensor) -> Tensor:
        """Rebuild features (batch, length) from the code of `encode`."""
        result: Tensor = self.join(self.stretch(code).transpose(1, 2))[:, :, 0]
        return result

    def stretch(self, code: Tensor) -> Tensor:
        """Stretch the code of `encode` to (batch, 256, length)."""
        x = code.transpose(1, 2)
        lengths = [self.length >> times for times in reversed(range(len(SIGHT_FILTERS)))]
        for layer, length in zip(self.decoder, lengths, strict=True):
            # every place twice; the last one once more where an odd length was halved
            x = torch.relu(layer(x)).repeat_interleave(2, dim=1)
            x = x if x.shape[1] == length else torch.cat([x, x[:, -1:]], dim=1)
        return x.transpose(1, 2)

    def embed(self, code: Tensor) -> Tensor:
        """Return the embedding (batch, 128) of the code of `encode`."""
        return torch.relu(self.second(self.hidden(code)))

    def hidden(self, code: Tensor) -> Tensor:
        """Return the hidden layer (batch, 512) of the code of `encode`."""
        given = self.decode(code) if self.after_reconstruction else code.flatten(1)
        return torch.relu(self.first(given))


class ConvLSTM1D(nn.Module):
    """One layer: a long short-term memory at each place, whose gates see the neighbouring places too.

    (i, f, g, o) = W * x_t + U * h_(t-1) + b;  c_t = s(f) c_(t-1) + s(i) tanh(g);  h_t = s(o) tanh(c_t)

    where * is a convolution over places with zeros beyond the ends, s the logistic function, h_0 = c_0 = 0. Gates stand
    in torch.nn.LSTM's order: with a kernel of one and a single place it is that layer.
    """

    def __init__(self, channels: int, filters: int, kernel: int = KERNEL) -> None:
        super().__init__()
        if kernel < 1 or kernel % 2 == 0:
            raise MaterialError(f"a kernel of {kernel} places has no middle: an odd number is expected.")
        self.channels, self.filters = channels, filters
        self.given = RowConv(channels, 4 * filters, kernel)
        self.kept = RowConv(filters, 4 * filters, kernel, bias=False)
        self._initialise_weights()

    def forward(self, x: Tensor) -> Tensor:
        """(batch, steps, channels, places) to the hidden state of every step (batch, steps, filters, places).

        Raises MaterialError for another shape.
        """
        if x.ndim != 4 or x.shape[2] != self.channels or not x.shape[1]:
            raise MaterialError(f"a ConvLSTM came to {tuple(x.shape)}: (batch, steps, {self.channels}, places) needed.")
        given, kept = self.given(x.permute(1, 0, 3, 2)), self.kept.matrix().T
        hidden: list[Tensor] = []
        cell: Tensor | None = None
        for step in given.unbind(0):  # (batch, places, gates)
            gates = step
            if hidden:  # before the first step there is nothing kept
                past = neighbours(hidden[-1], self.kept.kernel).flatten(0, 1)
                gates = torch.addmm(step.flatten(0, 1), past, kept).view(step.shape)
            enter, stay, new, leave = gates.chunk(4, dim=2)
            entering = torch.sigmoid(enter) * torch.tanh(new)
            cell = entering if cell is None else torch.sigmoid(stay) * cell + entering
            hidden.append(torch.sigmoid(leave) * torch.tanh(cell))
        return torch.stack(hidden, dim=1).transpose(2, 3)

    def _initialise_weights(self) -> None:
        """Initialise the weights: Glorot's from the input, orthogonal ones from the past, a forget gate that stays."""
        with torch.no_grad():
            for weights in self.given.weight.chunk(4):
                nn.init.xavier_uniform_(weights, gain=GAIN)
            for weights in self.kept.weight.chunk(4):
                weights.zero_()
                nn.init.orthogonal_(weights[:, :, weights.shape[2] // 2])
            if self.given.bias is not None:
                self.given.bias.zero_()
                self.given.bias[self.filters : 2 * self.filters] = 1.0


class HTNet(nn.Module):
    """(batch, steps, channels, places) of segments to 128 numbers each.

    The last hidden state of the last layer, (128, places), is averaged over its places. An odd step at the end stays by
    itself where steps are halved: of ten steps five, three and two are left, so that the last layer still has a past.
    """

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.channels = channels
        inputs = (channels, *TOUCH_FILTERS[:-1])
        self.layers = nn.ModuleList(ConvLSTM1D(*sizes) for sizes in zip(inputs, TOUCH_FILTERS, strict=True))

    def forward(self, x: Tensor) -> Tensor:
        """(batch, steps, channels, places) to (batch, 128). Raises MaterialError for another shape."""
        return self.stages(x)[-1][:, -1].mean(dim=2)

    def stages(self, x: Tensor) -> list[Tensor]:
        """Return the output of each layer, halved where it is: (batch, steps, filters, places)."""
        if x.ndim != 4 or x.shape[2] != self.channels or 0 in x.shape[1:]:
            raise MaterialError(f"HT-Net came to {tuple(x.shape)}: (batch, steps, {self.channels}, places) is needed.")
        result: list[Tensor] = []
        for place, layer in enumerate(self.layers, 1):
            x = layer(x)
            if place in POOLED:
                x = halved(x)
            result.append(x)
        return result


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


def dense(inputs: int, outputs: int, gain: float = 2.0) -> nn.Linear:
    """Return a dense layer whose weights `_initialise` has set."""
    layer = nn.Linear(inputs, outputs)
    _initialise(layer.weight, layer.bias, gain / inputs)
    return layer


def _conv(inputs: int, filters: int, kernel: int) -> RowConv:
    """Return a convolution of this width, whose weights `_initialise` has set."""
    layer = RowConv(inputs, filters, kernel)
    _initialise(layer.weight, layer.bias, 2.0 / (inputs * kernel))
    return layer


def _initialise(weight: Tensor, bias: Tensor | None, variance: float) -> None:
    """Initialise the weights as He et al. 2015 do for ReLU, and so that the weights of each unit sum to 0.

    What comes out of a ReLU has a mean; summed up, layer after layer, it would drown what differs between two rows. Of
    a single channel all is kept.
    """
    with torch.no_grad():
        weight.normal_(0.0, variance**0.5)
        if weight.shape[1] > 1:
            weight -= weight.flatten(1).mean(dim=1).view(-1, *[1] * (weight.ndim - 1))
        if bias is not None:
            bias.zero_()


def neighbours(x: Tensor, kernel: int) -> Tensor:
    """(..., places, channels) to (..., places, kernel x channels): what a kernel sees of each place, tap by tap."""
    places, wide = x.shape[-2], _around(x, kernel)
    return torch.cat([wide[..., tap : tap + places, :] for tap in range(kernel)], dim=-1)


def greater_of_two(x: Tensor) -> Tensor:
    """(batch, places, ...) to the greater of every two places; the last one of an odd number is left out."""
    even = x.shape[1] // 2 * 2
    return torch.maximum(x[:, 0:even:2], x[:, 1:even:2])


def _around(x: Tensor, kernel: int) -> Tensor:
    """Return the rows with the zeros that a kernel sees beyond the ends."""
    return functional.pad(x, (0, 0, kernel // 2, (kernel - 1) // 2))


def halved(x: Tensor) -> Tensor:
    """(batch, steps, ...) to the greater of every two steps, (batch, half as many rounded up, ...)."""
    return torch.cat([greater_of_two(x), x[:, x.shape[1] // 2 * 2 :]], dim=1)


def hv_net_shapes(network: HVNet, rows: Tensor) -> dict[str, tuple[int, ...]]:
    """Return the shape of every stage for rows (batch, length), by name; channels before length."""
    with torch.no_grad():
        code = network.encode(rows)
        hidden, seen = network.hidden(code), network(rows)
        stretched = network.stretch(code)
    made = {"code": code, "stretched": stretched, "rebuilt": seen.rebuilt}
    stages = {**made, "hidden": hidden, "embedded": seen.embedded}
    return {name: tuple(stage.shape[1:]) for name, stage in stages.items()}


def ht_net_shapes(network: HTNet, x: Tensor) -> dict[str, tuple[int, ...]]:
    """Return the shape after every layer for segments (batch, steps, channels, places), and of the answer, by name."""
    with torch.no_grad():
        stages = network.stages(x)
        shapes = {f"layer {place}": tuple(stage.shape[1:]) for place, stage in enumerate(stages, 1)}
        return {**shapes, "embedded": tuple(network(x).shape[1:])}
