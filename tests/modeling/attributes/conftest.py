"""One ResNet-50 for all tests that look at pictures, which looks at the same patches once."""

import hashlib
from functools import cache

import pytest

from palpate.modeling.attributes import seeing

make_network = seeing._network


@cache
def network_of(weights):
    network, known = make_network(weights), {}
    pooled = network.pooled

    def pooled_once(patches):
        key = hashlib.sha256(patches.numpy().tobytes()).digest()
        if key not in known:
            known[key] = pooled(patches)
        return known[key]

    network.pooled = pooled_once
    return network


@pytest.fixture(autouse=True)
def one_network(monkeypatch):
    """For pictures that are looked at in this process; another one makes its own."""
    monkeypatch.setattr(seeing, "_network", network_of)
