"""Two networks trained against each other learn a distribution, and a killed training goes on to the same bits."""

import numpy as np
import pytest
import torch
from torch import nn

from palpate.modeling.training import loop
from palpate.modeling.training.adversarial import Adversarial, Adversaries, energy_distance, two_adams
from palpate.modeling.training.checkpoints import write_checkpoint
from palpate.modeling.training.loop import adam, train
from palpate.modeling.training.optimisers import clipped
from palpate.modeling.training.refusals import CheckpointError, TrainingError
from palpate.modeling.training.seeding import seeded
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import GeneratedRows, Pairs, pairs
from tests.modeling.training.small import the_same

pytestmark = pytest.mark.needs("torch")


class Joined(nn.Module):
    """A small network that reads two inputs side by side."""

    def __init__(self, inputs):
        super().__init__()
        self.layers = nn.Sequential(nn.Linear(inputs, 16), nn.LeakyReLU(0.2), nn.Linear(16, 1))

    def forward(self, one, other):
        return self.layers(torch.cat([one, other], dim=1))


def adversaries(seed=1):
    return seeded(lambda: Adversaries(Joined(3), Joined(2)), seed)


def rows(count, seed):
    """A number whose mean and spread follow the condition."""
    chance = np.random.Generator(np.random.PCG64(seed))
    condition = chance.uniform(-1, 1, (count, 1))
    return condition, 2 + condition + (0.5 + 0.4 * condition) * chance.standard_normal((count, 1))


def source(seed=2):
    whole = pairs(*rows(256, seed))

    def make(chosen, chance):
        condition, real = whole.batch(chosen, chance)
        return (condition, torch.randn(len(chosen), 2, generator=chance)), real

    return GeneratedRows(len(whole), make, whole.digest)


def held():
    whole = pairs(*rows(64, 3))
    return Pairs((whole.inputs, torch.randn(64, 2, generator=torch.Generator().manual_seed(4))), whole.targets)


STEP = Adversarial(0.05)


def trained(network=None, step=STEP, **other):
    network = network or adversaries()
    settings = Settings(**{"epochs": 6, "batch": 32, "learning_rate": 5e-3, "plateau_patience": None, **other})
    return network, train(
        network, source(), held(), energy_distance, settings, optimiser=two_adams, train_one=step, clock=lambda: 0.0
    )


def test_what_is_made_comes_to_be_distributed_as_what_is_real():
    result = trained(epochs=14)[1]
    assert result.best_loss < 0.1 * result.history[0].watched
    assert result.history[result.best_epoch - 1].train_loss < 0.2 * result.history[0].train_loss


def test_each_step_moves_one_network_only():
    network, source_ = adversaries(), source()
    optimiser = two_adams(list(network.parameters()), 1e-2)
    seen = []
    plain = optimiser.step

    def step():
        seen.append({name: weight.grad is not None for name, weight in network.named_parameters()})
        plain()

    optimiser.step = step
    Adversarial()(network, optimiser, source_, energy_distance, Settings(epochs=1, batch=256), 1)
    critic, generator = seen
    assert all(moved == name.startswith("critic.") for name, moved in critic.items())
    assert all(moved == name.startswith("generator.") for name, moved in generator.items())


class Slope(nn.Module):
    """A critic whose gradient is known everywhere."""

    def __init__(self):
        super().__init__()
        self.weight = nn.Parameter(torch.tensor([[3.0], [4.0]]))

    def forward(self, _condition, x):
        return x @ self.weight


def test_the_penalty_is_half_the_squared_gradient_at_what_is_real():
    zeros = torch.zeros(5, 2)
    plain, priced = (Adversarial(penalty)._critic_loss(Slope(), zeros, zeros, zeros) for penalty in (0.0, 0.5))
    assert float((priced - plain).detach()) == pytest.approx(12.5)


def test_the_energy_distance_is_none_within_a_distribution_and_grows_with_a_shift():
    chance = torch.Generator().manual_seed(1)
    one, other = (torch.randn(400, 3, generator=chance) for _ in range(2))
    assert abs(float(energy_distance(one, other))) < 0.01
    assert float(energy_distance(one, other + 1)) > 30 * abs(float(energy_distance(one, other)))
    assert float(energy_distance(one[:1], other[:1])) == 0


def test_one_network_alone_is_refused():
    with pytest.raises(TrainingError, match="not a generator with a critic"):
        trained(Joined(3))


def test_a_source_without_noise_is_refused():
    condition, real = rows(8, 1)
    network = adversaries()
    with pytest.raises(TrainingError, match="condition and noise"):
        Adversarial()(
            network, two_adams(list(network.parameters()), 1e-3), pairs(condition, real), energy_distance,
            Settings(epochs=1), 1,
        )  # fmt: skip


def test_cut_off_and_continued_is_the_same_to_the_bit(tmp_path, monkeypatch):
    """What is on disk is what a kill leaves; tests/modeling/training/test_killed.py kills the same loop."""

    def cut_off(folder, checkpoint):
        write_checkpoint(folder, checkpoint)
        if checkpoint.epoch == 3:
            raise KeyboardInterrupt

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(loop, "write_checkpoint", cut_off)
        trained(checkpoint=tmp_path)
    whole, continued = trained(), trained(checkpoint=tmp_path)
    assert continued[1].continued_from == 3
    assert the_same(whole, continued)


def test_a_checkpoint_of_another_way_of_stepping_is_refused(tmp_path):
    trained(checkpoint=tmp_path, epochs=1)
    with pytest.raises(CheckpointError, match="steps"):
        trained(checkpoint=tmp_path, step=Adversarial(0.2), epochs=2)


def stepped(optimise, slope):
    weight = nn.Parameter(torch.zeros(2))
    optimiser = optimise([weight], 1.0)
    for size in (slope, 1.0):
        weight.grad = torch.tensor([0.6, 0.8]) * size
        optimiser.step()
    return weight.detach()


def test_a_gradient_that_is_too_long_is_shortened_and_another_is_left_alone():
    assert torch.allclose(stepped(clipped(1.0), 1e6), stepped(adam, 1.0), rtol=1e-4)
    assert torch.equal(stepped(clipped(10.0), 2.0), stepped(adam, 2.0))


def test_a_checkpoint_of_another_clipping_is_refused(tmp_path):
    def run(length, epochs):
        settings = Settings(epochs=epochs, checkpoint=tmp_path)
        network = seeded(lambda: nn.Linear(1, 1), 1)
        train(network, pairs(*rows(16, 1)), None, nn.functional.mse_loss, settings, optimiser=clipped(length))

    run(1.0, 1)
    with pytest.raises(CheckpointError, match="optimiser"):
        run(2.0, 2)


@pytest.mark.parametrize("length", [0, -1, float("nan"), float("inf")])
def test_a_clipping_without_sense_is_refused(length):
    with pytest.raises(TrainingError, match="expected above 0"):
        clipped(length)
