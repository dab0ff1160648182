"""What commands print, and their exit codes, against texts that are kept beside this file.

To write the texts anew: RENEW_SNAPSHOTS=1 .venv/bin/python -m pytest tests/snapshots. A commit that changes a text
changes nothing else, and its difference is read line by line.
"""

from __future__ import annotations

import pytest

from tests.snapshots.texts import call, compare, make_lab, run

RUNS = {
    "studies": ["studies", "studies --json", "check door_ratings", "check nonsense", "check door_ratings --json"],
    "plan": [
        "plan door_ratings --participant P001",
        "plan texture_ratings --participant P007 --json",
        "plan nonsense",
        "plan door_ratings --row 999",
        "plan texture_similarity --session 3",
    ],
    "run": [
        "init NEW",
        "run door_ratings --participant P001..P002 --simulate --seed 1 --lab NEW",
        "run nonsense --lab NEW",
        "run door_ratings --participant P001 --simulate --lab NEW",
        "run door_ratings --lab NEW",
        "run door_ratings --participant P001 --simulate --lab NOWHERE",
        "run door_ratings --participant P09 --lab LAB",
    ],
    "resume": [
        "resume LAB/sessions/texture_ratings_P002_s1.sqlite",
        "resume LAB/sessions/nothing.sqlite",
        "resume LAB/sessions/door_capture_P002_s1.sqlite --json",
        "resume LAB/sessions/texture_ratings_P001_s1.sqlite",
        "resume LAB/README.md",
    ],
    "replay": [
        "replay LAB/sessions/door_ratings_P001_s1.sqlite",
        "replay --lab LAB --workers 1 --json",
        "replay LAB/README.md",
    ],
    "collect": [
        "collect --lab LAB",
        "collect --rebuild --lab LAB",
        "collect --lab LAB",
        "collect --lab LAB --json",
        "collect --lab LAB --to sqlite:///LAB/participants/registry.sqlite",
        "collect --lab LAB --to nonsense://x",
    ],
    "participants": [
        "participants list --lab LAB",
        "participants balance texture_ratings --lab LAB",
        "participants add --lab LAB",
        "participants add --pseudonym P0001 --lab LAB",
        "participants overlap texture_ratings --lab LAB",
    ],
    "rig": ["rig simulate --lab LAB", "rig kinds"],
    "streams": [
        "streams LAB/sessions/texture_capture_P001_s1.sqlite",
        "streams show LAB/sessions/door_ratings_P001_s1.sqlite",
        "streams --help",
    ],
    "models": [
        "models list --lab LAB",
        "models list --json",
        "models card door-perception --lab LAB",
        "models card nonsense",
        "models compare door-perception door-force --lab LAB",
    ],
    "predict": [
        "predict LAB/README.md",
        "predict --wish Nonsense=3",
        "predict profile.csv",
        "predict profile.csv --json",
    ],
    "import": [
        "import imported/sponges.yaml --lab LAB",
        "import nothing.yaml --lab LAB",
        "import profile.csv --lab LAB",
    ],
    "analyse": ["analyse sponges --lab LAB", "analyse nonsense --lab LAB", "analyse texture_ratings --lab LAB"],
    "regenerate": [
        "regenerate sponges --lab LAB --no-figures",
        "regenerate sponges --lab LAB --check",
        "regenerate nonsense --lab LAB",
        "regenerate texture_ratings --lab LAB --check-plan",
    ],
    "export": ["export texture_ratings --lab LAB --to shared --csv", "export texture_ratings --lab LAB --to shared"],
    "textures": ["textures find rough --lab LAB", "textures show cloth --lab LAB", "textures nearest cloth --lab LAB"],
    "mistakes": ["nonsense", "stuides", "run --nonsense", "doors nonsense"],
}
"""Commands by the text that keeps what they print; LAB is a copy of the frozen lab, of each text its own."""
NOT_COLLECTED = {"collect", "replay", "resume", "run"}
"""Texts of commands in a lab whose database was not made anew."""


@pytest.mark.parametrize("name", RUNS)
def test_commands_print_what_they_printed(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    make_lab(tmp_path)
    if name not in NOT_COLLECTED:
        call("collect --rebuild --lab LAB", capsys)
    compare(f"commands/{name}", run(RUNS[name], tmp_path, capsys))
