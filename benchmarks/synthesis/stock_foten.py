"""A straightforward FoTEN of stock modules, torch's FFT and a DataLoader, for comparison in the bench only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.autograd import backward
from torch.optim import Adam
from torch.utils.data import DataLoader, TensorDataset

from palpate.modeling.textures.foten import SETTINGS
from palpate.modeling.textures.foten_network import DROPOUT, HEADS, HIDDEN, LAYERS, UNITS, WIDTH, huber, positions
from palpate.modeling.textures.foten_network import FOURIER_HEADS as SPECTRUM_HEADS
from palpate.modeling.textures.foten_network import FOURIER_WIDTH as SPECTRUM_WIDTH
from palpate.modeling.training.sources import Pairs

DELTA = 1.6


def _encoder(layers: int, width: int, heads: int) -> nn.TransformerEncoder:
    layer = nn.TransformerEncoderLayer(width, heads, HIDDEN, DROPOUT, batch_first=True)
    return nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)


class _Spectrum(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.embedding = nn.Linear(1, SPECTRUM_WIDTH)
        self.encoder = _encoder(1, SPECTRUM_WIDTH, SPECTRUM_HEADS)
        self.dense = nn.Linear(SPECTRUM_WIDTH, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (batch, length) to the same shape."""
        answers: Tensor = self.dense(self.encoder(self.embedding(x[..., None])))
        return answers[..., 0]


class StockFoten(nn.Module):
    """A network with as many weights as `Foten`, from (batch, 3, window) to (batch, 1)."""

    place: Tensor

    def __init__(self, window: int) -> None:
        super().__init__()
        self.register_buffer("place", positions(window, WIDTH))
        self.embedding = nn.Linear(1, WIDTH)
        self.encoder = _encoder(LAYERS, WIDTH, HEADS)
        self.magnitude, self.phase = _Spectrum(), _Spectrum()
        first, second = UNITS
        self.head = nn.Sequential(
            nn.Linear(window * (WIDTH + 3), first), nn.ReLU(), nn.Linear(first, second), nn.ReLU(), nn.Linear(second, 1)
        )

    def forward(self, x: Tensor) -> Tensor:
        """Map (batch, 3, window) to (batch, 1)."""
        past = x[:, 0]
        encoded = self.encoder(self.embedding(past[..., None]) + self.place)
        spectrum = torch.fft.fft(past)
        turned = torch.polar(torch.ones_like(past), self.phase(spectrum.angle()))
        back = torch.fft.ifft(self.magnitude(spectrum.abs()) * turned).real
        beside = torch.stack([back, x[:, 1], x[:, 2]], dim=-1)
        answer: Tensor = self.head(torch.cat([encoded, beside], dim=-1).flatten(1))
        return answer


@dataclass(frozen=True)
class Course:
    """Seconds up to the end of each epoch, and the validation MAE then."""

    seconds: tuple[float, ...]
    mae: tuple[float, ...]


def train_plainly(
    train: Pairs, validation: Pairs, window: int, epochs: int, seed: int, clock: Callable[[], float]
) -> Course:
    """Train with Adam, batches of 16 from a DataLoader, validating after each epoch (thesis 4.4.5)."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network, loss = StockFoten(window), huber(DELTA)
        chance = torch.Generator().manual_seed(seed)
        loader = DataLoader(_dataset(train), SETTINGS.batch, shuffle=True, generator=chance)
        watched = DataLoader(_dataset(validation), 64)
        optimiser = Adam(network.parameters(), lr=SETTINGS.learning_rate)
        began, seconds, mae = clock(), [], []
        for _ in range(epochs):
            network.train()
            for inputs, targets in loader:
                optimiser.zero_grad()
                backward(loss(network(inputs), targets))
                optimiser.step()
            mae.append(_validation_mae(network, watched))
            seconds.append(clock() - began)
    return Course(tuple(seconds), tuple(mae))


def _dataset(rows: Pairs) -> TensorDataset:
    return TensorDataset(torch.as_tensor(rows.inputs), torch.as_tensor(rows.targets))


def _validation_mae(network: nn.Module, rows: DataLoader[tuple[Tensor, ...]]) -> float:
    network.eval()
    with torch.no_grad():
        off = [(network(inputs) - targets).abs() for inputs, targets in rows]
    return float(torch.cat(off).mean())
