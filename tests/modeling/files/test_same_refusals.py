"""A model's file refuses what the trained model refuses, and answers what that answers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.modeling.doors.linear import MEAN, RIDGE
from palpate.modeling.doors.model_scores import ports
from palpate.modeling.doors.nearest import NEAREST
from palpate.modeling.doors.preparing import FURTHEST_N
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.modeling.files.model_files import write_model
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.file import read_model
from tests.modeling.doors.baseline_learning import learn, unseen_rows


@pytest.mark.parametrize(
    ("method", "direction", "low", "high"),
    [
        (MEAN, "forward", -FURTHEST_N, FURTHEST_N),
        (RIDGE, "forward", -FURTHEST_N, FURTHEST_N),
        (NEAREST, "inverse", -100.0, 200.0),
    ],
)
def test_file_and_trained_model_answer_and_refuse_the_same_inputs(tmp_path, method, direction, low, high):
    learning = learn()
    fitted = method.fit(learning)
    context = SimpleNamespace(data=learning.measured, scaling=learning.scaling)
    takes, gives = ports(context.data, context.scaling, direction)
    card = write_model(tmp_path, "m", fitted.exported(), title="", method=method.name, takes=takes, gives=gives)
    read = read_model(card)
    given = unseen_rows(method)[:2].copy()
    for value in (low, high):
        given[1, 3] = value
        np.testing.assert_allclose(read.run(given), fitted.predict(given), rtol=1e-9)
    for value in (np.nextafter(low, -np.inf), np.nextafter(high, np.inf), 1e6):
        given[1, 3] = value
        with pytest.raises(ModelDataError, match="row 2"):
            fitted.predict(given)
        with pytest.raises(ModelInputError, match="row 2"):
            read.run(given)
