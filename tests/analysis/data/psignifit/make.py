"""Numbers of psignifit 4.3 for tests/analysis/choices.

Made in an environment of its own (`pip install psignifit==4.3`).
Run from the repository's root: python tests/analysis/data/psignifit/make.py
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import psignifit

SETS = json.loads(Path("tests/analysis/data/r/choices.json").read_text())["sets"]
CASES = (("yes_no", "yes/no", "norm"), ("two_choice", "2AFC", "norm"), ("two_choice", "2AFC", "weibull"))


def fitted(name: str, experiment: str, sigmoid: str) -> dict[str, object]:
    """Posterior means and 95 % percentiles; a Weibull function wants logarithms of the levels."""
    given = SETS[name]
    levels = np.log(given["level"]) if sigmoid == "weibull" else np.array(given["level"], dtype=float)
    trials = np.broadcast_to(given["n"], len(levels))
    data = np.column_stack([levels, given["k"], trials])
    result = psignifit.psignifit(
        data, experiment_type=experiment, sigmoid=sigmoid, CI_method="percentiles", verbose=False
    )
    mean = {key: float(value) for key, value in result.get_parameter_estimate(estimate_type="mean").items()}
    ends = {key: [float(end) for end in of["0.95"]] for key, of in result.confidence_intervals.items()}
    return {"set": name, "experiment": experiment, "sigmoid": sigmoid, "mean": mean, "ci95": ends}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    content = {"made_with": {"psignifit": "4.3", "numpy": np.__version__}, "fits": [fitted(*case) for case in CASES]}
    Path("tests/analysis/data/psignifit/psignifit.json").write_text(json.dumps(content, indent=1) + "\n")
