"""The thesis' networks, written to files and run with NumPy, answer as torch does."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from palpate.modeling.doors.networks import ForceToPerception, conv_relu, exported_network
from palpate.modeling.files.model_files import Exported, write_model
from palpate.signals.models.card import Port, Reshape
from palpate.signals.models.file import read_model

pytestmark = pytest.mark.needs("torch")


def ratings(size):
    return Port(kind="ratings", size=size, unit="0..100")


def require_alike(folder, exported, takes, gives, given, expected):
    card = write_model(folder, "network", exported, title="", method="network", takes=takes, gives=gives)
    model = read_model(card)
    near = 1e-5 * np.abs(expected).max()
    assert np.abs(model.run(given) - expected).max() < near
    assert np.abs([model.run(row) for row in given] - expected).max() < near


def test_the_forward_network_answers_from_its_file_as_in_torch(tmp_path):
    torch.manual_seed(5)
    network = ForceToPerception().eval()
    given = np.random.Generator(np.random.PCG64(2)).uniform(0, 100, (3, 621))
    with torch.no_grad():
        expected = network(torch.tensor(given, dtype=torch.float32)).numpy()
    takes = Port(kind="force_profile", size=621, unit="N")
    require_alike(tmp_path, exported_network(network), takes, ratings(7), given, expected)


def test_the_inverse_networks_kinds_of_layers_do_so_too(tmp_path):
    torch.manual_seed(6)
    nn = torch.nn
    network = nn.Sequential(
        nn.Conv1d(1, 8, 2), nn.ReLU(), nn.MaxPool1d(2), *conv_relu(8, 16), nn.Upsample(scale_factor=2), nn.Flatten(),
        nn.Linear(96, 5),
    ).eval()  # fmt: skip
    given = np.random.Generator(np.random.PCG64(3)).uniform(0, 100, (20, 7))
    with torch.no_grad():
        expected = network(torch.tensor(given, dtype=torch.float32)[:, None]).numpy()
    plain = exported_network(network)
    exported = Exported((Reshape(shape=(1, 7)), *plain.steps), plain.tensors)
    require_alike(tmp_path, exported, ratings(7), ratings(5), given, expected)
