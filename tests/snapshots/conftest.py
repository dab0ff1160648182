"""What a terminal is to all snapshots: 100 characters wide, without colours, on no display."""

import pytest

from tests.snapshots.texts import WIDTH


@pytest.fixture(autouse=True)
def plain_terminal(monkeypatch):
    for name, value in {"COLUMNS": str(WIDTH), "NO_COLOR": "1", "TERM": "dumb", "LINES": "50"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("DISPLAY", raising=False)
