"""Search for a profile by gradient descent until the forward network predicts the wished ratings.

The search runs over principal components of the measured profiles, scaled to an SD of 1. It seeks the most probable
profile for normally distributed codes, and ratings with an SD of `RATING_SD` around the network's predictions
(Tarantola 2005, 1.2): half the squared error over that SD, plus half the squared Mahalanobis distance from the mean
profile. An unattainable wish would outweigh any penalty, so no code is farther from the mean profile than that of the
farthest measured profile (projected gradient).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.random import PCG64, Generator, SeedSequence
from torch import Tensor, nn

from palpate.modeling.doors.forward_network import FittedForward
from palpate.modeling.doors.linear import Components, components_of
from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.preparing import TrainingRows, checked_wishes, on_one_thread, rows_of
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.modeling.files.model_files import Exported
from palpate.modeling.training.seeding import training_state
from palpate.signals.arrays import Array
from palpate.signals.doors.limits import bounded_profiles

RATING_SD = 3.0
"""The SD of the mean of twenty raters on 0..100, approximately."""
COMPONENTS = 15
NEAREST = 2
"""A search starts at this number of the nearest rated profiles, at the mean profile, and at a random one."""
FIRST, MORE, QUICK = 10, 20, (4, 8)
"""Steps from every start, and further steps from the best of them."""
RATE = 0.15
AT_ONCE = 16
"""Wishes that are searched for together, as a compromise between speed and memory."""


@dataclass(frozen=True)
class Codes:
    """Profiles as uncorrelated codes with a mean of 0 and an SD of 1 on the training profiles."""

    components: Components
    sd: Array

    def of(self, force_N: Array) -> Array:
        """Return codes (n, k) of profiles (n, 621)."""
        return self.components.codes(force_N) / self.sd

    def decoded(self, code: Array) -> Array:
        """Return profiles (n, 621) of codes (n, k)."""
        return self.components.mean + (code * self.sd) @ self.components.directions


def codes_of(force_N: Array) -> Codes:
    """Return the codes' scaling by the training profiles (n, 621). Raises ModelDataError where all are equal."""
    components = components_of(force_N, COMPONENTS)
    if not len(components.directions):
        raise ModelDataError("all training profiles are equal: there are no directions to search in.")
    return Codes(components, components.codes(force_N).std(axis=0))


@dataclass(frozen=True)
class Searching:
    """A fitted search: a forward network, the codes to search in, and the rated profiles to start from."""

    network: nn.Module
    codes: Codes
    rating: Array
    code: Array
    reach: float
    drawn: Array
    steps: tuple[int, int]

    def predict(self, given: Array) -> Array:
        """Return profiles (n, 621) in newtons, within the limits, for wishes (n, attributes) on 0..100.

        Raises ModelDataError for wishes far off that scale.
        """
        wish = checked_wishes(given, self.rating.shape[1])
        parts = [self._search(wish[at : at + AT_ONCE]) for at in range(0, len(wish), AT_ONCE)]
        return bounded_profiles(self.codes.decoded(np.concatenate(parts)))

    def exported(self) -> Exported:
        """Raise ModelDataError: a search needs gradients, which the runtime of model files does not have."""
        raise ModelDataError(
            "search: needs torch whenever it makes a profile and cannot be written as a model file; "
            "export the generator or the network instead."
        )

    def _search(self, wish: Array) -> Array:
        """Return the best codes (n, k) for these wishes."""
        with training_state(0, 1):
            self.network.eval()
            # starts (n, starts, k): nearest rated profiles, the mean profile, one that the seed drew for all wishes
            far = ((wish[:, None] - self.rating) ** 2).sum(axis=2)
            near = self.code[np.argsort(far, axis=1, kind="stable")[:, :NEAREST]]
            others = np.stack([np.zeros_like(self.drawn), self.drawn])
            starts = np.concatenate([near, np.broadcast_to(others, (len(wish), *others.shape))], axis=1)
            wishes = np.repeat(wish, starts.shape[1], axis=0)
            code, cost = self._descended(starts.reshape(len(wishes), -1), wishes, self.steps[0])
            best = np.argmin(cost.reshape(len(wish), -1), axis=1)
            code = code.reshape(starts.shape)[np.arange(len(wish)), best]
            return self._descended(code, wish, self.steps[1])[0]

    def _descended(self, start: Array, wish: Array, steps: int) -> tuple[Array, Array]:
        """Return the best codes and their costs on the path from these starts, in this number of steps of Adam."""
        code = torch.tensor(start, dtype=torch.float32, requires_grad=True)
        self._pull_back(code)
        adam = torch.optim.Adam([code], lr=RATE)
        best, least = start.copy(), np.full(len(start), np.inf)
        target = torch.from_numpy(wish.astype(np.float32, order="C"))
        for step in range(steps + 1):
            cost = self._cost(code, target)
            costs = cost.detach().numpy().astype(np.float64)
            better = costs < least
            best[better], least[better] = code.detach().numpy()[better], costs[better]
            if step < steps:
                (code.grad,) = torch.autograd.grad(cost.sum(), [code])
                adam.step()
                self._pull_back(code)
        return best, least

    def _pull_back(self, code: Tensor) -> None:
        with torch.no_grad():
            code *= self.reach / code.norm(dim=1, keepdim=True).clamp(min=self.reach)

    def _cost(self, code: Tensor, wish: Tensor) -> Tensor:
        """Return the cost (n,): half the squared error in SDs, plus half the squared distance from the mean profile."""
        components = self.codes.components
        mean, directions, sd = (
            torch.as_tensor(part, dtype=torch.float32)
            for part in (components.mean, components.directions, self.codes.sd)
        )
        off = (self.network(mean + (code * sd) @ directions) - wish) / RATING_SD
        cost: Tensor = ((off**2).sum(dim=1) + (code**2).sum(dim=1)) / 2
        return cost


@on_one_thread
def fit(learning: Learning) -> Searching:
    """Return a search with the forward network and the training profiles' codes; nothing is trained.

    Raises ModelDataError for data that cannot be learned from or without a forward network.
    """
    if not isinstance(learning.forward, FittedForward):
        raise ModelDataError("search: needs the gradient of a trained forward network: none was given.")
    rows: TrainingRows = rows_of(learning, least=2)
    codes = codes_of(rows.force_N)
    code = codes.of(rows.force_N)
    drawn: Array = Generator(PCG64(SeedSequence([learning.seed]))).standard_normal((code.shape[1],))
    steps = QUICK if learning.settings.get("quick") else (FIRST, MORE)
    reach = float(np.linalg.norm(code, axis=1).max())
    return Searching(learning.forward.network, codes, rows.rating, code, reach, drawn, steps)


SEARCH = Method(
    name="search",
    title="Gradient search through the forward network",
    fit=fit,
    needs_forward="network",
    source="Tarantola 2005; principal components of the measured profiles",
)
