"""How every command that writes is driven, and the lab that it is driven in.

The commands come from the command table: a test fails for one that stands neither here nor among those that write
nothing.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import click
from PIL import Image

from palpate import command_line

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
    "window screens": "window screens --out screens --size 1280x720",
    "record": "record texture_capture --participant P003 --group pilot --simulate",
    "resume": "resume killed/sessions/door_lexicon_P002_s1.sqlite --accept-change",
    "rig calibrate": "rig calibrate vibration --rig twins.yaml --yes --seconds 0.2 --write",
    "rig certify": "rig certify shaker --rig twins.yaml --yes --bursts 20 --write",
    "extensions new": "extensions new task acme.grip --in-lab",
    "power": "power doors_small --test variants --participants 2 --runs 10 --jobs 1",
    "bench": "bench intervals --quick --out bench",
}
"""Every command that writes, as it is driven; the lab is LAB where the command takes one."""
TEXTURES = {
    "textures simulate": "textures simulate --textures T01,T15 --seconds 6 --pictures 1 --raters 1 --lab new",
    "textures index": "textures index --without-model --workers 1 --pictures shown",
    "textures find": "textures find rough --sheet sheet.png --map map.png",
    "textures nearest": "textures nearest T01 --sheet sheet.png",
    "textures show": "textures show T01 --sheet sheet.png",
    "textures map": "textures map rough",
    "textures draw": "textures draw T01 --out figures",
}
"""The same, driven in a lab of simulated textures with a library."""
MODELS = {
    "train doors": "train doors --simulated --quick --forward ridge --inverse nearest --workers 1",
    "train textures": "train textures --simulated --quick --methods ar --textures cloth --workers 1",
    "train attributes": "train attributes --quick --method ridge --workers 1",
    "evaluate doors": "evaluate doors --simulated --quick --methods ridge --workers 1",
    "evaluate textures": "evaluate textures --simulated --quick --methods ar --textures cloth --workers 1 --no-figures",
    "evaluate attributes": "evaluate attributes --quick --methods ridge --workers 1 --no-figures",
}
"""The same, after their trainings: finished results are cached, so each goes on from there and writes."""
DRIVEN = {**WRITES, **TEXTURES, **MODELS}
TO_DATABASES = {"init", "participants", "run", "record", "resume", "collect", "import"}
DATABASES = tuple(name for name in WRITES if name.split()[0] in TO_DATABASES)
"""Those that write to a database, not only by the one writer of files."""
SAME_WRITER = ("train textures", "train attributes", "evaluate doors", "evaluate attributes")
"""They write with the functions of `train doors` and `evaluate textures`: driven only when the page is written."""
SLOW = ("power", "bench", "rig certify", "window screens", "doors draw", "analyse", "report", "regenerate", "render",
        "textures simulate", "textures find", "textures map", "textures draw",
        *(name for name in MODELS if name not in SAME_WRITER))  # fmt: skip
"""Those that compute for seconds before they write, and are tested."""
LEFT_OUT = {
    "author": "a window that a person moves sliders in; its designs are written by the same writer: tests/protocols",
    "window calibrate": "a display, whose socket the faults break too; its file is written as that of rig calibrate",
    "demo": "two minutes; made of other commands, each driven here",
}
"""Commands that write and are not driven, with the reason."""
WRITES_NOTHING = (
    "participants list", "participants balance", "participants overlap", "studies", "check", "plan", "replay",
    "extensions list", "extensions check", "rig check", "rig kinds", "window check", "streams list", "models list",
    "models card", "models compare",
)  # fmt: skip


def commands() -> dict[str, click.Command]:
    """Return every command of the command table by its whole name."""
    context = click.Context(command_line.cli)
    return dict(
        described
        for verb in command_line.VERBS
        for described in _walk(verb, command_line.cli.get_command(context, verb))
    )


def _walk(name: str, command: click.Command | None) -> Iterator[tuple[str, click.Command]]:
    if isinstance(command, click.Group):
        for inner, subcommand in command.commands.items():
            yield from _walk(f"{name} {inner}", subcommand)
    elif command is not None:
        yield name, command


def arguments(name: str) -> list[str]:
    """Return the words after `palpate` that drive a command."""
    takes_a_lab = any("--lab" in parameter.opts for parameter in commands()[name].params)
    words = DRIVEN[name].split()
    return [*words, *(["--lab", "lab"] if takes_a_lab and "--lab" not in words else [])]


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
    shutil.copytree(RECORDED / "doors_small", folder / "drawn")
    call("import", str(folder / "sponges.yaml"), str(folder / "sponges.csv"), "--lab", str(lab))
    call("collect", "--lab", str(lab))
    (folder / "killed" / "sessions").mkdir(parents=True)
    for path in (RECORDED / "frozen" / "lab" / "sessions").glob("door_lexicon_P002_s1.sqlite*"):
        shutil.copy(path, folder / "killed" / "sessions" / path.name)
    call("rig", "simulate", "--out", str(folder / "twins.yaml"))
    for name in ("report.html", "monitor.html", "rig.yaml", "out.csv", "door.csv", "doors.png", "played.npz"):
        (folder / name).write_text("what was here before\n")


def make_textures(folder: Path) -> None:
    """Make a working directory: a lab of three simulated textures and its library."""
    words = ["--textures", "T01,T15,T33", "--seconds", "6", "--pictures", "1", "--raters", "1"]
    call("textures", "simulate", *words, "--lab", str(folder / "lab"))
    call("textures", "index", "--without-model", "--workers", "1", "--lab", str(folder / "lab"))
    (folder / "shown").mkdir()
    for name in ("T01", "T15", "T33"):
        Image.new("RGB", (30, 30), "red").save(folder / "shown" / f"{name}.png")
    for name in ("sheet.png", "map.png"):
        (folder / name).write_text("what was here before\n")


def make_models(folder: Path, names: Sequence[str]) -> None:
    """Add these trainings, finished, to a working directory of textures, but no model."""
    for name in names:
        call(*MODELS[name].split(), "--lab", str(folder / "lab"))
    for path in (folder / "lab" / "models").glob("[!.]*.*"):
        path.unlink()


def call(*words: str) -> None:
    """Run a command line that must succeed."""
    if (code := command_line._status(list(words))) != 0:
        raise AssertionError(f"{' '.join(words)}: {code}")
