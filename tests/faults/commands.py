"""How every command that writes is driven, and the lab that it is driven in.

The commands come from the command table: a test fails for one that stands neither here nor among those that write
nothing.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import click

import palpate

ROOT = Path(__file__).parents[2]
RECORDED = ROOT / "tests" / "recorded"
PLAN = """\
study: doors_small
exclusions: []
tests:
  - {name: variants, test: anova, within: [variant]}
figures:
  - {name: means, figure: means, by: [variant]}
"""
WRITES = {
    "init": "init new",
    "participants add": "participants add --name Kim",
    "participants identify": "participants identify P001 --contact kim@example.org",
    "participants withdraw": "participants withdraw P001 --why asked",
    "participants export": "participants export",
    "participants allocate": "participants allocate doors_small P001",
    "participants release": "participants release doors_small P002 --why ill",
    "run": "run doors_small --participant P003 --simulate --seed 1 --session 2",
    "collect": "collect --rebuild",
    "rig simulate": "rig simulate --out rig.yaml --force",
    "doors normalise": "doors normalise profile.csv --out out.csv",
    "doors simulate": "doors simulate --door G90 --door K8 --out doors",
    "doors augment": "doors augment profile.csv --out doors",
    "doors make": "doors make --study door_capture --out doors",
    "doors draw": "doors draw drawn --out doors.png",
    "samples": "samples samples",
    "import": "import sponges.yaml sponges.csv --replace",
    "analyse": "analyse sponges",
    "report": "report sponges --to report.html",
    "regenerate": "regenerate doors_small",
    "export": "export doors_small --csv --to shared",
    "streams export": "streams export lab/sessions/doors_small_P001_s1.sqlite --trial 2 --raw --out streams",
    "monitor": "monitor --once monitor.html",
    "render": "render cloth --hand simulated --seconds 1 --out played.npz",
    "predict": "predict door-force --wish Damped=30 --to door.csv",
    "window screens": "window screens --out screens",
}
"""Every command that writes, as it is driven; the lab is LAB where the command takes one."""
LEFT_OUT = {
    "record": "as run, at a station", "resume": "as run: tests/studies/test_kill.py ends it at every instant",
    "rig calibrate": "needs a device; its file: tests/protocols/test_files.py",
    "author": "a window; as window calibrate",
    "window calibrate": "a person measures; its file is written as that of rig simulate",
    "power": "minutes; its files are those of analyse",
    "train doors": "minutes; tests/modeling/files/test_writing.py", "train textures": "minutes; as train doors",
    "train attributes": "minutes; as train doors", "evaluate doors": "minutes; its folder is staged as that of analyse",
    "evaluate textures": "as evaluate doors", "evaluate attributes": "as evaluate doors",
    "textures simulate": "minutes; its sessions are written as by run", "textures index": "tests/modeling/library",
    "textures find": "its sheet: tests/modeling/library/test_sheet.py", "textures nearest": "as textures find",
    "textures show": "as textures find", "textures map": "its map: tests/modeling/library/test_map.py",
    "textures draw": "its figures are saved as those of analyse",
    "demo": "made of other commands", "bench": "its plots are saved as the figures of analyse",
}  # fmt: skip
"""Commands that write and are not driven, with the reason."""
WRITES_NOTHING = (
    "participants list", "participants balance", "participants overlap", "studies", "check", "plan", "replay",
    "rig check", "rig kinds", "window check", "streams list", "models list", "models card", "models compare",
)  # fmt: skip


def commands() -> dict[str, click.Command]:
    """Return every command of the command table by its whole name."""
    context = click.Context(palpate.cli)
    return dict(found for verb in palpate.VERBS for found in _walk(verb, palpate.cli.get_command(context, verb)))


def _walk(name: str, command: click.Command | None) -> Iterator[tuple[str, click.Command]]:
    if isinstance(command, click.Group):
        for inner, found in command.commands.items():
            yield from _walk(f"{name} {inner}", found)
    elif command is not None:
        yield name, command


def arguments(name: str) -> list[str]:
    """Return the words after `palpate` that drive a command."""
    takes_a_lab = any("--lab" in parameter.opts for parameter in commands()[name].params)
    return [*WRITES[name].split(), *(["--lab", "lab"] if takes_a_lab else [])]


def make_lab(folder: Path) -> None:
    """Make a working directory: a lab with people, sessions, a database and results, and files to read."""
    lab = folder / "lab"
    call("init", str(lab))
    for name in ("P001", "P002", "P003"):
        call("participants", "add", "--pseudonym", name, "--name", f"Person {name}", "--lab", str(lab))
    shutil.copytree(RECORDED / "doors_small", lab / "studies" / "doors_small")
    (lab / "studies" / "doors_small" / "analysis.yaml").write_text(PLAN)
    for path in sorted((RECORDED / "sessions").glob("*_P00*.sqlite")):
        shutil.copy(path, lab / "sessions" / path.name)
    call("participants", "allocate", "doors_small", "P002", "--lab", str(lab))
    for path in (RECORDED / "frozen" / "imported").iterdir():
        shutil.copy(path, folder / path.name)
    shutil.copy(RECORDED / "doors_small" / "profiles" / "BC3_g0.csv", folder / "profile.csv")
    shutil.copytree(ROOT / "studies" / "door_ratings", folder / "drawn")
    call("import", str(folder / "sponges.yaml"), str(folder / "sponges.csv"), "--lab", str(lab))
    call("collect", "--lab", str(lab))
    for name in ("report.html", "monitor.html", "rig.yaml", "out.csv", "door.csv", "doors.png", "played.npz"):
        (folder / name).write_text("what was here before\n")


def call(*words: str) -> None:
    """Run a command line that must succeed."""
    if (code := palpate._status(list(words))) != 0:
        raise AssertionError(f"{' '.join(words)}: {code}")
