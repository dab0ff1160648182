"""What commands print, and their exit codes, against the texts stored beside this file.

To write the texts anew: RENEW_SNAPSHOTS=1 .venv/bin/python -m pytest tests/snapshots. A commit that changes a text
changes nothing else, and its difference is read line by line.
"""

from __future__ import annotations

import shutil

import pytest

from tests.snapshots.texts import PLANS, compare, make_lab, read_page, run, without_numbers, without_what_varies

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
    "records_more": [
        "run nonsense --participant P001 --lab LAB",
        "run door_ratings --participant P001 --simulate --session 0 --lab LAB",
        "run PLANS/mistakes/unknown --participant P001 --simulate --lab LAB",
        "record texture_capture --participant P011 --group nonsense --simulate --lab LAB",
        "record door_ratings --participant P011 --simulate --lab LAB",
        "streams list LAB/sessions/door_ratings_P001_s1.sqlite",
        "streams list LAB/sessions/door_capture_P001_s1.sqlite --json",
        "streams list LAB/README.md",
        "streams export LAB/sessions/texture_capture_P001_s1.sqlite --trial 99 --out streams",
        "participants list --lab LAB --json",
        "participants balance texture_ratings --lab LAB --json",
        "participants overlap texture_ratings --lab LAB --json",
        "participants add --pseudonym P012 --lab LAB --json",
        "participants withdraw P099 --why asked --lab LAB",
        "participants allocate texture_ratings P099 --lab LAB",
        "participants release texture_ratings P001 --why ill --lab LAB",
        "participants identify P001 --lab LAB",
        "participants export --lab LAB",
        "resume LAB/sessions/texture_ratings_P001_s1.sqlite --json",
        "init LAB",
    ],
    "doors": [
        "doors normalise profile.csv --out out.csv",
        "doors normalise nothing.csv --out out.csv",
        "doors normalise PLANS/mistakes/cells.csv --out out.csv",
        "doors simulate --door G90 --door K8 --out doors",
        "doors simulate --door NONE --out doors",
        "doors augment profile.csv --out augmented",
        "doors make --study door_capture --out made",
        "doors make --study nonsense --out made",
        "doors draw nothing --out doors.png",
    ],
    "models_more": [
        "predict profile.csv --model door-perception --lab LAB",
        "predict door-perception profile.csv --lab LAB",
        "predict door-perception profile.csv --lab LAB --json",
        "predict door-force --wish Damped=30 --to door.csv --lab LAB",
        "predict door-force --wish Damped=300 --lab LAB",
        "predict nonsense profile.csv --lab LAB",
        "models card texture-cloth-ar --lab LAB --json",
        "models compare texture-cloth-ar texture-cloth-dstn --lab LAB",
        "models compare door-perception door-perception --lab LAB --json",
    ],
    "rooms_more": [
        "author --lab LAB --model nonsense",
        "author --lab LAB --model door-perception",
        "author --lab LAB --windowed big",
        "bench nonsense",
        "demo --lab LAB",
        "render nonsense --lab LAB",
        "render cloth --hand nothing.csv --lab LAB",
        "render cloth --method nonsense --hand simulated --lab LAB",
        "render cloth --seconds 1 --lab LAB",
        "window calibrate --lab LAB --width-mm 1",
        "window screens --out screens --size huge",
        "window screens --out screens --language xx",
        "rig check --lab LAB --rig PLANS/mistakes/rig.yaml",
        "rig check --lab LAB --rig nothing.yaml",
        "rig kinds --json",
        "rig calibrate nonsense --lab LAB",
        "samples samples",
        "samples samples",
        "samples PLANS/plan.yaml",
        "power texture_ratings --test nonsense --lab LAB",
        "power texture_ratings --test classes --participants 4..2 --lab LAB",
        "power nonsense --test classes --lab LAB",
        "textures find rough --lab LAB --json",
        "textures nearest cloth --lab LAB --json",
        "textures index --lab NOWHERE",
        "train",
        "evaluate nonsense",
    ],
    "mistakes_in_files": [
        "check PLANS/mistakes/unknown",
        "check PLANS/mistakes/unknown --json",
        "check PLANS/mistakes/broken",
        "plan PLANS/mistakes/unknown",
        "regenerate sponges --plan PLANS/mistakes/plan.yaml --lab LAB",
        "regenerate sponges --plan PLANS/mistakes/plan.yaml --lab LAB --json",
        "regenerate sponges --plan PLANS/mistakes/plan_kinds.yaml --lab LAB",
        "regenerate sponges --plan PLANS/mistakes/plan_names.yaml --lab LAB",
        "regenerate sponges --plan nothing.yaml --lab LAB",
        "import PLANS/mistakes/cells.yaml --lab LAB",
        "import PLANS/mistakes/cells.yaml --lab LAB --json",
        "import PLANS/mistakes/columns.yaml --lab LAB",
        "import PLANS/towels.yaml PLANS/korean.csv --lab LAB",
    ],
    "answers_as_json": [
        "import PLANS/towels.yaml --lab LAB --json",
        "regenerate towels --plan PLANS/korean_plan.yaml --lab LAB --json",
        "regenerate sponges --lab LAB --no-figures --no-crosscheck --json",
        "regenerate sponges --lab LAB --check --json",
        "export texture_ratings --lab LAB --to shared --psych-ds --json",
        "export sponges --lab LAB --to other --bids --json",
        "export texture_ratings --lab LAB --to bids --bids",
        "analyse sponges --lab LAB --reference nothing.json#key",
        "analyse sponges --lab LAB --codes nothing.csv",
        "report texture_similarity --lab LAB --digest 00",
    ],
    "mistakes": ["nonsense", "stuides", "run --nonsense", "doors nonsense"],
}
"""Commands by the text that keeps what they print; LAB is a copy of the frozen lab, of each text its own."""
NOT_COLLECTED = {"collect", "doors", "replay", "resume", "run"}
"""Texts of commands in a lab whose database was not rebuilt."""
TOLERANCES = {"models_more": 1e-9}
"""What a model answers differs in the last bits between processors, by its matrix products (1e-13 was seen)."""


@pytest.mark.parametrize("name", RUNS)
def test_commands_print_what_they_printed(name, tmp_path, monkeypatch, capsys, rebuilt):
    monkeypatch.chdir(tmp_path)
    make_lab(tmp_path)
    shutil.copytree(PLANS, tmp_path / "PLANS")
    if name not in NOT_COLLECTED:
        shutil.copy(rebuilt, tmp_path / "LAB")
    compare(f"commands/{name}", run(RUNS[name], tmp_path, capsys), TOLERANCES.get(name, 0))


LONG_RUNS = {
    "monitor_mistakes": [
        "monitor --lab NOWHERE",
        "monitor --lab LAB --host 0.0.0.0 --token short",
        "monitor --lab LAB --port 99999",
    ],
    "render": ["render cloth --method ar --hand simulated --seconds 1 --out played.npz --lab LAB"],
    "record": [
        "init NEW",
        "record texture_capture --participant P003 --group pilot --simulate --lab NEW",
        "streams list NEW/sessions/texture_capture_P003_s1.sqlite",
        "streams export LAB/sessions/texture_capture_P001_s1.sqlite --trial 2 --out streams",
    ],
    "power": [
        "power texture_ratings --test classes --participants 2..3 --runs 10 --jobs 1 --lab LAB",
        "power texture_ratings --test classes --participants 2..3 --runs 10 --jobs 1 --lab LAB --json",
    ],
    "bench": ["bench intervals --quick --out bench"],
    "window": ["window screens --out screens"],
    "textures_library": [
        "textures simulate --textures T01,T15,T33 --seconds 6 --pictures 1 --raters 1 --lab NEW",
        "textures index --without-model --workers 1 --lab NEW",
        "textures find rough --lab NEW",
        "textures find rough --lab NEW --json",
        "textures find Rough=90,Hard=10 --lab NEW",
        "textures nearest T01 --lab NEW",
        "textures nearest T99 --lab NEW",
        "textures show T01 --lab NEW",
        "textures show T01 --lab NEW --json",
        "textures map nonsense --lab NEW",
    ],
}
"""The same, for the full run."""


@pytest.mark.long
@pytest.mark.needs("torch", "librosa", "pywt", "skimage", "compiler", "flask")
@pytest.mark.parametrize("name", LONG_RUNS)
def test_long_commands_print_what_they_printed(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    make_lab(tmp_path)
    compare(f"commands/{name}", without_numbers(run(LONG_RUNS[name], tmp_path, capsys)))


def test_the_monitor_s_page_is_unchanged(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    make_lab(tmp_path)
    printed = run(["monitor --once page.html --lab LAB", "monitor --json --lab LAB"], tmp_path, capsys)
    page = read_page((tmp_path / "page.html").read_text(encoding="utf-8"))
    compare("commands/monitor", f"{printed}\n{without_what_varies(page, tmp_path)}\n")
