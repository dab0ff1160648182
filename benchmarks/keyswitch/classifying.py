"""Methods of classifying a switch as linear, tactile or clicky by its curve."""

from __future__ import annotations

import numpy as np
import torch
from sklearn.decomposition import PCA
from sklearn.dummy import DummyClassifier
from sklearn.linear_model import RidgeClassifierCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.tree import DecisionTreeClassifier
from sklearn.utils.class_weight import compute_class_weight
from torch import nn

from benchmarks.keyswitch.bump import bump
from benchmarks.keyswitch.curves import KINDS
from benchmarks.keyswitch.networks import classifier
from benchmarks.keyswitch.outcome import Fitted
from benchmarks.keyswitch.reconstructing import centring_of, predict, settings_of
from benchmarks.keyswitch.settings import Size
from palpate.modeling.training.loop import train
from palpate.modeling.training.seeding import seeded
from palpate.modeling.training.sources import Pairs, pairs
from palpate.protocols.progress import Report
from palpate.signals.arrays import Array, Indices

PENALTIES = tuple(float(10**k) for k in np.linspace(-3, 3, 13))
WEIGHTS = "balanced"
"""Weights by which every kind counts equally in every fit: there are five times as many linear as clicky switches."""


def commonest(train_rows: Array, kinds: Indices, _code: int, _size: Size, _report: Report) -> Fitted:
    """Predict the most frequent kind for every switch."""
    fitted = DummyClassifier(strategy="most_frequent").fit(train_rows, kinds)
    return lambda curves: np.asarray(fitted.predict(curves))


def ridge(train_rows: Array, kinds: Indices, code: int, _size: Size, _report: Report) -> Fitted:
    """Fit ridge regression on principal components; the penalty is chosen by leave-one-out within the training side."""
    steps = PCA(code, svd_solver="full"), StandardScaler(), RidgeClassifierCV(PENALTIES, class_weight=WEIGHTS)
    fitted = make_pipeline(*steps).fit(train_rows, kinds)
    return lambda curves: np.asarray(fitted.predict(curves))


def tree(train_rows: Array, kinds: Indices, _code: int, size: Size, _report: Report) -> Fitted:
    """Fit a decision tree of depth 2 on three features of the bump."""
    fitted = DecisionTreeClassifier(max_depth=2, class_weight=WEIGHTS, random_state=size.seed)
    fitted.fit(bump(train_rows), kinds)
    return lambda curves: np.asarray(fitted.predict(bump(curves)))


def network(train_rows: Array, kinds: Indices, _code: int, size: Size, report: Report) -> Fitted:
    """Fit the forward network of thesis 5.4 with cross-entropy and Adam."""
    model = seeded(lambda: classifier(len(KINDS)), size.seed)
    weights = torch.ones(len(KINDS))
    present = np.unique(kinds)
    weights[present] = torch.from_numpy(compute_class_weight(WEIGHTS, classes=present, y=kinds)).float()
    centring = centring_of(train_rows)
    inputs = pairs(centring.up(train_rows), kinds).inputs
    loss = nn.CrossEntropyLoss(weight=weights)
    train(model, Pairs(inputs, torch.from_numpy(kinds)), None, loss, settings_of(size), report=report)
    return lambda curves: np.argmax(predict(model, centring.up(curves), size), axis=1)


METHODS = {"commonest kind": commonest, "ridge on PCA": ridge, "tree on the bump": tree, "network": network}
