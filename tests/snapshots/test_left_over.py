"""Every stored text is compared by a test."""

from tests.snapshots.test_commands import LONG_RUNS, RUNS
from tests.snapshots.test_reports import LONG_SCENES, SCENES
from tests.snapshots.texts import EXPECTED, command_line


def test_every_stored_text_is_compared_with_something():
    compared = {
        *(f"help/{name}" for name in ("palpate", *command_line.VERBS)),
        *(f"commands/{name}" for name in (*RUNS, *LONG_RUNS, "monitor")),
        *(f"evaluations/{name}" for name in ("doors", "textures", "attributes")),
        *(f"reports/{name}" for name in (*SCENES, *LONG_SCENES)),
    }
    stored = {path.relative_to(EXPECTED).with_suffix("").as_posix() for path in EXPECTED.rglob("*.*")}
    assert sorted(stored ^ compared) == []
