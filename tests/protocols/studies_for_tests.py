"""Small studies that the tests run."""

from __future__ import annotations

from typing import Any

from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow


def toy(**changes: Any) -> Study:
    """Four stimuli, two attributes, Williams order, a rest in the middle, going back allowed."""
    data: dict[str, Any] = {
        "study": "toy",
        "task": "slider_rating",
        "stimuli": [{"id": name, "columns": {"size": str(n), "kind": "xy"[n % 2]}} for n, name in enumerate("ABCD")],
        "attributes": [["Soft", "Hard"], ["Cold", "Warm"]],
        "scale": {"from": -10, "to": 10, "step": 1},
        "order": {"design": "williams"},
        "rest": {"every": 2},
        "navigation": "back_and_forward",
        "simulation": {"latents": {"Soft": {"size": 4.0}}, "noise_sd": 1.0, "bias_sd": 0.5},
    }
    return Study.model_validate({**data, **changes})


def toy_plan(participant: str = "P001", row: int = 0, seed: int = 0, session: int = 1, **changes: Any) -> Plan:
    """The toy study compiled."""
    return compile_plan(toy(**changes), ParticipantRow(participant, None, row), seed, session=session)
