"""The two networks of thesis 5.4 and 5.6, with exactly its shapes: force to perception, and perception to force."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from palpate.modeling.layers import ResidualBlock, conv_relu
from palpate.signals.doors.grid import POINTS

ATTRIBUTES = 7
LATENT = (128, 155)
"""Channels and length of what the encoder hands over (thesis 5.4.1.1: 155 x 128)."""
RESTORED = (64, 620)
HIDDEN = 128
DROPOUT = 0.1


def encoder() -> nn.Sequential:
    """(batch, 1, 621) to (batch, 128, 155): 64 filters, 128 filters, each with a residual block and a halving."""
    return nn.Sequential(
        *conv_relu(1, 64), ResidualBlock(64), nn.MaxPool1d(2),
        *conv_relu(64, 128), ResidualBlock(128), nn.MaxPool1d(2),
    )  # fmt: skip


def decoder() -> nn.Sequential:
    """(batch, 128, 155) to (batch, 64, 620): 128 filters, 64 filters, each with a residual block and a doubling."""
    return nn.Sequential(
        *conv_relu(128, 128), ResidualBlock(128), nn.Upsample(scale_factor=2),
        *conv_relu(128, 64), ResidualBlock(64), nn.Upsample(scale_factor=2),
    )  # fmt: skip


class ForceToPerception(nn.Module):
    """Thesis 5.4: encoder, decoder, a dense layer of 128 with dropout, and one value for each attribute."""

    def __init__(self, attributes: int = ATTRIBUTES) -> None:
        super().__init__()
        self.encoder = encoder()
        self.decoder = decoder()
        restored = RESTORED[0] * RESTORED[1]
        self.head = nn.Sequential(
            nn.Flatten(), nn.Linear(restored, HIDDEN), nn.ReLU(), nn.Dropout(DROPOUT), nn.Linear(HIDDEN, attributes)
        )

    def forward(self, force: Tensor) -> Tensor:
        """(batch, 621) scaled forces to (batch, attributes) scaled ratings."""
        ratings: Tensor = self.head(self.decoder(self.encoder(force.unsqueeze(1))))
        return ratings


class PerceptionToForce(nn.Module):
    """Thesis 5.6: four convolutions over the ratings, a dense layer to the latent shape, a frozen decoder, 621 values.

    The decoder's weights are those of a trained `ForceToPerception` and are not trained further.
    """

    def __init__(self, trained: nn.Sequential | None = None, attributes: int = ATTRIBUTES) -> None:
        super().__init__()
        self.encoder = nn.Sequential(
            nn.Conv1d(1, 64, 2), nn.ReLU(), nn.MaxPool1d(2),
            *conv_relu(64, 128), *conv_relu(128, 256), *conv_relu(256, 512), nn.Flatten(),
        )  # fmt: skip
        self.project = nn.Linear(512 * ((attributes - 1) // 2), LATENT[0] * LATENT[1])
        self.decoder = decoder()
        if trained is not None:
            self.decoder.load_state_dict(trained.state_dict())
        self.decoder.requires_grad_(False)
        self.out = nn.Sequential(nn.Flatten(), nn.Linear(RESTORED[0] * RESTORED[1], POINTS))

    def forward(self, ratings: Tensor) -> Tensor:
        """(batch, attributes) scaled ratings to (batch, 621) scaled forces."""
        latent = self.project(self.encoder(ratings.unsqueeze(1))).view(-1, *LATENT)
        force: Tensor = self.out(self.decoder(latent))
        return force


def shapes(force: Tensor, network: ForceToPerception) -> dict[str, tuple[int, ...]]:
    """The shape of every stage for a batch of forces (batch, 621), by name; channels before length."""
    with torch.no_grad():
        latent = network.encoder(force.unsqueeze(1))
        restored = network.decoder(latent)
        hidden = network.head[:2](restored)
        out = network.head[2:](hidden)
    stages = {"latent": latent, "restored": restored, "hidden": hidden, "ratings": out}
    return {name: tuple(stage.shape[1:]) for name, stage in stages.items()}
