"""The loop: repeatable, restored to its best weights, and never left with weights that are not finite."""

import itertools

import numpy as np
import pytest
import torch
from torch import nn

from palpate.modeling.training.loop import train
from palpate.modeling.training.refusals import TrainingError
from palpate.modeling.training.settings import Settings, course_of
from palpate.modeling.training.sources import GeneratedRows, Pairs, pairs
from tests.modeling.training.small import network, rows, settings, the_same, trained

pytestmark = pytest.mark.needs("torch")


def test_the_same_seed_gives_the_same_bits_whatever_ran_before():
    first = trained()
    torch.manual_seed(99)
    torch.rand(7)
    state = torch.get_rng_state()
    assert the_same(trained(), first)
    assert torch.equal(torch.get_rng_state(), state)
    assert not the_same(trained(seed=1), first)


@pytest.mark.parametrize("threads", [1, 2])
def test_convolutions_are_repeatable_too(threads):
    from palpate.modeling.training.seeding import seeded

    def conv():
        inner = (nn.Conv1d(1, 4, 3, padding=1), nn.ReLU(), nn.MaxPool1d(2), nn.Upsample(scale_factor=2))
        return nn.Sequential(nn.Unflatten(1, (1, 6)), *inner, nn.Flatten(), nn.Linear(24, 2))

    one, other = (trained(seeded(conv, 2), epochs=3, threads=threads) for _ in range(2))
    assert the_same(one, other)
    assert torch.get_num_threads() >= 1 and not torch.are_deterministic_algorithms_enabled()


def test_it_learns_and_ends_with_the_weights_of_its_best_epoch():
    inputs, targets = rows()
    model, result = trained(epochs=60, plateau_patience=None, learning_rate=0.05)
    assert 1 < result.best_epoch < 60  # it overfits: the last weights are not the best
    loss = nn.HuberLoss(delta=2.0)
    with torch.no_grad():
        given = torch.from_numpy(inputs[30:]).float()
        now = float(loss(model(given), torch.from_numpy(targets[30:]).float()))
    assert now == pytest.approx(result.best_loss, rel=1e-6)
    assert result.best_loss == min(epoch.held_loss for epoch in result.history)
    assert result.best_loss < 0.5 * float(loss(torch.zeros(10, 2), torch.from_numpy(targets[30:]).float()))
    assert not model.training


def test_early_stopping_ends_it_after_its_patience():
    _, result = trained(epochs=200, stop_patience=5, plateau_patience=None, learning_rate=0.05)
    assert result.stopped and len(result.history) == result.best_epoch + 6 < 200


def test_without_held_out_rows_the_loss_while_training_is_watched():
    inputs, targets = rows()
    result = train(network(), pairs(inputs, targets), None, nn.functional.mse_loss, settings(epochs=4))
    assert [epoch.held_loss for epoch in result.history] == [None] * 4
    assert result.best_loss == min(epoch.train_loss for epoch in result.history)


def test_the_schedule_is_that_of_torch():
    losses = np.abs(np.random.default_rng(2).normal(1, 0.3, 80)) * np.linspace(1, 0.2, 80)
    given = Settings(learning_rate=0.1, least_rate=1e-3, plateau_patience=2, plateau_factor=0.5)
    optimiser = torch.optim.SGD([nn.Parameter(torch.zeros(1))], lr=0.1)
    theirs = torch.optim.lr_scheduler.ReduceLROnPlateau(optimiser, patience=2, factor=0.5, min_lr=1e-3, eps=0.0)
    for epoch in range(1, 81):
        theirs.step(losses[epoch - 1])
        assert course_of(losses[:epoch], given).rate == theirs.get_last_lr()[0]
    assert course_of(losses, given).rate == 1e-3


def weights(model):
    return [tensor.clone() for tensor in model.state_dict().values()]


def spoiled_at(loss_number):
    """A loss that is not a number at its n-th call."""
    calls = itertools.count(1)
    return lambda answer, target: ((answer - target) ** 2).mean() * (np.nan if next(calls) == loss_number else 1.0)


def test_a_loss_that_is_no_number_ends_it_and_the_best_weights_so_far_are_there():
    model, _ = trained(epochs=2, loss=spoiled_at(10**6))  # an epoch is 4 batches and a held-out one
    good = weights(model)
    model = network()
    with pytest.raises(TrainingError, match=r"epoch 3, batch 2: the loss is nan") as caught:
        trained(model, loss=spoiled_at(5 + 5 + 2), epochs=5)
    assert (caught.value.epoch, caught.value.batch) == (3, 2)
    assert all(torch.equal(one, other) for one, other in zip(weights(model), good, strict=True))


def test_a_gradient_that_is_not_finite_ends_it_before_the_step():
    model = network()
    start = weights(model)
    with pytest.raises(TrainingError, match=r"epoch 1, batch 1: a gradient is not finite"):
        trained(model, loss=lambda answer, target: torch.sqrt((answer * 0).abs()).mean())
    assert all(torch.equal(one, other) for one, other in zip(weights(model), start, strict=True))


def test_a_loss_that_says_nothing_about_the_weights_is_refused():
    with pytest.raises(TrainingError, match="does not depend on the network's weights"):
        trained(loss=lambda _answer, target: target.mean())


def test_an_optimiser_with_rates_of_its_own_is_refused():
    def two(parameters, rate):
        return torch.optim.SGD([{"params": parameters[:1], "lr": rate / 10}, {"params": parameters[1:]}], lr=rate)

    data = pairs(*rows())
    with pytest.raises(TrainingError, match=r"rate is 0.002, 0.02: expected the one it was given, 0.02"):
        train(network(), data, None, nn.functional.mse_loss, settings(), optimiser=two)


def test_a_step_too_far_leaves_no_broken_weights():
    model = network()
    inputs, targets = rows()
    with pytest.raises(TrainingError, match="epoch 1"):
        train(
            model, pairs(inputs, targets * 1e18), None, nn.functional.mse_loss, settings(learning_rate=1e30),
            optimiser=lambda parameters, rate: torch.optim.SGD(parameters, lr=rate),
        )  # fmt: skip
    assert all(bool(torch.isfinite(tensor).all()) for tensor in weights(model))


EXTREMES = {
    "two rows": (np.eye(6)[:2], np.eye(2)),
    "all ratings equal": (rows()[0], np.full((40, 2), 50.0)),
    "constant inputs": (np.ones((40, 6)), rows()[1]),
    "float16": tuple(array.astype(np.float16) for array in rows()),
    "huge offset": (rows()[0] + 1e6, rows()[1]),
    "one spike of 1e6": (np.where(np.arange(240).reshape(40, 6) == 9, 1e6, rows()[0]), rows()[1]),
}


@pytest.mark.parametrize("case", EXTREMES)
def test_extreme_rows_leave_finite_weights(case):
    model = network()
    result = train(model, pairs(*EXTREMES[case]), None, nn.HuberLoss(delta=2.0), settings(epochs=3))
    assert np.isfinite([epoch.train_loss for epoch in result.history]).all()
    assert all(bool(torch.isfinite(tensor).all()) for tensor in weights(model))


def test_several_inputs_a_tuple_as_answer_and_frozen_weights():
    class Two(nn.Module):
        def __init__(self):
            super().__init__()
            self.frozen, self.head = nn.Linear(6, 3).requires_grad_(False), nn.Linear(4, 2)

        def forward(self, wide, narrow):
            both = self.head(torch.cat([self.frozen(wide), narrow], dim=1))
            return both[:, :1], both[:, 1:]

    inputs, targets = (torch.from_numpy(array).float() for array in rows())
    model = Two()
    frozen_before = weights(model.frozen)
    source = Pairs((inputs, inputs[:, :1]), (targets[:, :1], targets[:, 1:]))
    result = train(model, source, None, lambda a, t: sum(((x - y) ** 2).mean() for x, y in zip(a, t, strict=True)),
                  settings(epochs=6))  # fmt: skip
    assert result.history[-1].train_loss < result.history[0].train_loss
    assert all(torch.equal(one, other) for one, other in zip(weights(model.frozen), frozen_before, strict=True))


def test_rows_made_on_demand_are_augmented_the_same_way_again():
    inputs, targets = (torch.from_numpy(array).float() for array in rows())

    def noisy(which, chance):
        return inputs[which] + 0.3 * torch.randn(len(which), 6, generator=chance), targets[which]

    def once():
        model = network()
        return model, train(
            model, GeneratedRows(40, noisy, "a digest"), None, nn.functional.mse_loss, settings(epochs=3)
        )

    assert the_same(once(), once())


def test_the_time_left_is_reported():
    lines, ticks = [], itertools.count()
    trained(epochs=4, clock=lambda: 7.0 * next(ticks), report=lines.append)
    assert lines[0].startswith("epoch 1 of 4: loss ") and "held out" in lines[0] and "at most " in lines[0]
    assert lines[-1].endswith("done")


@pytest.mark.parametrize(
    ("model", "words"),
    [
        (nn.Linear(6, 2).requires_grad_(False), "no weights to train"),
        (nn.Linear(6, 2).to("meta"), "lies on meta"),
        (nn.Linear(6, 2, dtype=torch.complex64), "complex weights"),
        (nn.Sequential(nn.Linear(6, 2), nn.Linear(2, 2)), "not finite before"),
    ],
)
def test_a_network_that_cannot_be_trained_is_refused(model, words):
    if words.startswith("not finite"):
        nn.init.constant_(model[0].weight, float("nan"))
    with pytest.raises(TrainingError, match=words):
        trained(model)


@pytest.mark.parametrize(
    ("inputs", "targets", "words"),
    [
        (np.where(np.arange(12).reshape(4, 3) == 7, np.nan, 1.0), np.ones((4, 1)), "input: row 3 holds nan"),
        (np.ones((4, 3)), np.full((4, 1), 1e39), r"target: row 1 holds 1e\+39"),
        (np.ones((4, 3)), np.ones((5, 1)), r"shapes \[\(4, 3\), \(5, 1\)\]"),
        (np.ones((0, 3)), np.ones((0, 1)), "at least one row"),
    ],
)
def test_rows_that_nothing_can_be_learned_from_are_refused(inputs, targets, words):
    with pytest.raises(TrainingError, match=words):
        pairs(inputs, targets)


@pytest.mark.parametrize(
    "wrong",
    [{"epochs": 0}, {"batch": 2.5}, {"learning_rate": 1e-9}, {"learning_rate": float("nan")}, {"plateau_factor": 1.0},
     {"stop_patience": -1}, {"seed": True}, {"threads": 0}],
)  # fmt: skip
def test_settings_without_a_meaning_are_refused_by_name(wrong):
    with pytest.raises(TrainingError, match=next(iter(wrong))):
        Settings(**wrong)
