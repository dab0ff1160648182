"""The door networks' blocks on key-switch curves: through a code of a few numbers, and to a kind (thesis 5.4)."""

from __future__ import annotations

from torch import Tensor, nn

from benchmarks.keyswitch.curves import POINTS
from palpate.modeling.doors.networks import LATENT, RESTORED, ForceToPerception, decoder, encoder


class Reconstruction(nn.Module):
    """The encoder and decoder of thesis 5.4 with a code of `code` numbers between them.

    The inverse network's last layer (dense, 24.6 M weights for 119 curves) is replaced by a convolution of width 3 and
    a linear interpolation from 620 to 621 points.
    """

    def __init__(self, code: int) -> None:
        super().__init__()
        size = LATENT[0] * LATENT[1]
        self.encoder = nn.Sequential(encoder(), nn.Flatten(), nn.Linear(size, code))
        self.decoder = nn.Sequential(
            nn.Linear(code, size), nn.Unflatten(1, LATENT), decoder(),
            nn.Conv1d(RESTORED[0], 1, 3, padding=1), nn.Upsample(size=POINTS, mode="linear"), nn.Flatten(),
        )  # fmt: skip

    def forward(self, force: Tensor) -> Tensor:
        """Return scaled forces (batch, 621), reconstructed from the code."""
        restored: Tensor = self.decoder(self.encoder(force.unsqueeze(1)))
        return restored


def classifier(kinds: int) -> ForceToPerception:
    """Return the network of thesis 5.4 with one output for each kind instead of each attribute."""
    return ForceToPerception(kinds)
