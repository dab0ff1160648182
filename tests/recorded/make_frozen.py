"""Make the frozen lab: `PYTHONPATH=CLONE python tests/recorded/make_frozen.py`, with CLONE at the version to freeze.

Run once, with commit 1c74ba7. The lab never changes afterwards: it stands for the labs that people have.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

from palpate.devices.models.answers import profile_of, wish_of
from palpate.modeling.attributes.model_file import read_model as read_attributes
from palpate.modeling.attributes.registry import METHODS
from palpate.modeling.attributes.training import train_attributes
from palpate.protocols.events import Event, Reply, Request, World
from palpate.protocols.plan import Plan
from palpate.signals.models.file import read_model
from palpate.signals.textures.voice import play
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.launching.launch import plans_of
from palpate.studies.sessions.record import read
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session import start
from palpate.studies.sessions.session_files import ledger_path
from palpate.studies.simulation.rig import simulated
from tests.modeling.attributes import small_evaluation
from tests.studies.shipped import TEN
from tests.studies.simulation.small_textures import TEXTURES, write_all
from tools.half_precision import halve

HERE = Path(__file__).resolve().parent
LAB, EXPECTED, IMPORTED = (HERE / "frozen" / name for name in ("lab", "expected.json", "imported"))
GROUPS = {"door_capture": "pilot", "texture_capture": "pilot", "texture_photos": "pilot"}
STUDIES = sorted((*TEN, "texture_photos"))
"""The studies that were shipped when the lab was frozen."""
RATERS = ("P003", "P004", "P005", "P006")
TRAINED = ("ar", "dstn", "hapinf", "foten_generative")
PROFILE = HERE / "frozen" / "profile.csv"
STROKE = [20.0 + n % 50 for n in range(200)], [1.0 + 0.01 * (n % 30) for n in range(200)]
"""Speeds in mm/s and forces in N of a hand, at 1 kHz."""
WISH = ("Easy-to-pull=20", "Damped=30")
MAP = """name: sponges
source: made up for this lab
licence: CC0-1.0
files: sponges.csv
columns:
  participant: rater
  stimulus: sponge
  attribute: word
  value: rating
  within: {size: size}
scale: {from: 0, to: 100}
"""
PLAN = """study: sponges
draws: 100
tests:
  - {name: means, test: means, by: [size]}
  - {name: sizes, test: anova, within: [size]}
  - {name: pairs, test: pairs, factor: size, correction: holm}
  - {name: ranks, test: friedman, factor: size}
  - {name: agreement, test: icc, targets: stimulus, raters: participant}
"""


def palpate(*arguments: str, lab: Path = LAB) -> str:
    """Run a command of the version to freeze and return what it printed."""
    command = [sys.executable, "-m", "palpate", *arguments, "--lab", str(lab)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def main(trained: Path) -> None:
    """Make the lab again; models that were trained before lie in `trained`."""
    shutil.rmtree(LAB, ignore_errors=True)
    subprocess.run([sys.executable, "-m", "palpate", "init", str(LAB)], check=True)
    palpate("rig", "simulate", "--out", str(LAB / "stations" / "BENCH" / "rig.yaml"))
    for name in STUDIES:  # with the shipped models
        run(name, "P001", LAB)
    train(trained)
    run("texture_ratings", "P001", LAB, session=2)
    for who in RATERS:
        run("texture_ratings", who, LAB)
    run("texture_similarity", "P003", LAB)
    heads = {path.name: head for path, head in map(kill, STUDIES)}
    palpate("participants", "add", "--pseudonym", "P004", "--name", "Example Person", "--consented", "2026-03-31")
    palpate("participants", "withdraw", "P004", "--why", "on request")
    kill_live("P011")
    import_table()
    for name in ("texture_ratings", "sponges"):
        (LAB / "studies" / name).mkdir(parents=True)
    shutil.copy(SHIPPED / "texture_ratings" / "analysis.yaml", LAB / "studies" / "texture_ratings")
    (LAB / "studies" / "sponges" / "analysis.yaml").write_text(PLAN)
    palpate("collect")
    for name in ("texture_ratings", "sponges"):
        palpate("regenerate", name, "--no-figures")
    shutil.rmtree(LAB / "sessions" / ".locks")
    for file in (LAB / "sessions").glob("*-shm"):
        file.unlink()
    shutil.copy(SHIPPED / "door_ratings" / "profiles" / "K8_g0.csv", PROFILE)
    EXPECTED.write_text(json.dumps({"heads": heads, "models": answers(LAB)}, indent=1) + "\n")


def run(study: str, who: str, lab: Path, session: int = 1) -> None:
    """Run a simulated session of a study."""
    group = ["--group", GROUPS[study]] if study in GROUPS else []
    palpate("run", study, "--participant", who, "--simulate", "--session", str(session), *group, lab=lab)


def train(folder: Path) -> None:
    """Put a model of each kind into the lab; small ones stand for the textures that nothing was trained on."""
    if not folder.exists():
        one_core = ("--quick", "--simulated", "--workers", "1")
        palpate("train", "doors", *one_core, lab=folder.parent)
        palpate(
            "train", "textures", *one_core, "--textures", "cloth", "--methods", ",".join(TRAINED), lab=folder.parent
        )
    for name in ("door-perception", "door-force"):
        for suffix in (".json", ".safetensors"):
            (LAB / "models").mkdir(exist_ok=True)
            shutil.copy(folder / f"{name}{suffix}", LAB / "models")
    for method in TRAINED:
        halve(folder / f"texture-cloth-{method}.json", LAB / "models")
    write_all(LAB, [texture for texture in TEXTURES if texture != "cloth"])
    with tempfile.TemporaryDirectory() as work:
        options = small_evaluation.options(Path(work), quick=True)
        own = {"ridge": (("hand",), ("glcm",))}
        train_attributes(small_evaluation.material(), "ridge", options, LAB / "models", METHODS, own)


def kill(study: str) -> tuple[Path, str]:
    """Kill a session of P002 in mid-trial; return its ledger, and the last hash of the same session run to its end."""
    study_files = read_study(SHIPPED / study / "study.yaml")
    [plan] = plans_of(study_files.study, LAB, ["P002"], 0, live=False, group=GROUPS.get(study))
    rig = simulated(study_files.study, study_files.folder, LAB)
    with tempfile.TemporaryDirectory() as lab:
        whole = read(start(Path(lab), plan, rig).path)
    requests = sum(event.kind == "request" for event in whole.events)
    pid = os.fork()
    if pid == 0:
        start(LAB, plan, killing(rig, requests // 2))
        os._exit(1)
    if os.WTERMSIG(os.waitpid(pid, 0)[1]) != signal.SIGKILL:
        raise SystemExit(f"{study}: the session was not killed")
    return ledger_path(LAB, study, "P002"), whole.head


def kill_live(who: str) -> None:
    """Kill a real participant's session, at the twins of the rig file, while a sample is put in place."""
    palpate("participants", "add", "--pseudonym", who)
    options = ["--group", "pilot", "--rig", str(LAB / "stations" / "BENCH" / "rig.yaml"), "--lab", str(LAB)]
    command = [sys.executable, "-m", "palpate", "record", "texture_photos", "--participant", who, *options]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout or ():
            if "Put in place" in line:
                process.kill()


@dataclass
class Killed:
    """A world that kills its own process at the first request of a trial from the n-th request on."""

    world: World
    requests: int
    in_trial: bool = False

    def now(self) -> int:
        return self.world.now()

    def watch(self, event: Event) -> None:
        self.in_trial = event.kind == "request" and event.trial is not None

    def perform(self, request: Request) -> Reply:
        self.requests -= 1
        if self.requests < 0 and self.in_trial:
            os.kill(os.getpid(), signal.SIGKILL)
        return self.world.perform(request)


def killing(rig: RigPlan, requests: int) -> RigPlan:
    """The same rig, but its session is killed in mid-trial, after at least so many requests."""

    def opened(plan: Plan, t_ns: int) -> Rig:
        whole = rig.open(plan, t_ns)
        killed = Killed(whole.world, requests)
        return replace(whole, world=killed, watch=killed.watch)

    return replace(rig, open=opened)


def import_table() -> None:
    """Import a small foreign table: six raters, four sponges, two words."""
    IMPORTED.mkdir(parents=True, exist_ok=True)
    (IMPORTED / "sponges.yaml").write_text(MAP)
    with (IMPORTED / "sponges.csv").open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["rater", "sponge", "size", "word", "rating"])
        for rater in range(6):
            for sponge in range(4):
                for word, name in enumerate(("Soft", "Rough")):
                    rating = (37 * rater + 53 * sponge + 29 * word) % 101
                    rows.writerow(
                        [f"r{rater}", f"s{sponge}", ("small", "medium", "large", "huge")[sponge], name, rating]
                    )
    palpate("import", str(IMPORTED / "sponges.yaml"), str(IMPORTED / "sponges.csv"))


def answers(lab: Path) -> dict[str, list[float]]:
    """Return what each of the lab's models answers."""
    models = lab / "models"
    force = read_model(models / "door-force.json")
    texture = small_evaluation.material().textures[0]
    return {
        "door-perception": read_model(models / "door-perception.json").run(profile_of(PROFILE, False, False)).tolist(),
        "door-force": force.run(wish_of(WISH, force.card.takes)).tolist(),
        "texture-attributes": read_attributes(models).predict(texture).ravel().tolist(),
        **{f"texture-cloth-{method}": played(models / f"texture-cloth-{method}.json") for method in TRAINED},
    }


def played(card: Path) -> list[float]:
    """Return what a texture's model plays for the hand of STROKE."""
    return [float(sample) for sample in play(card, *STROKE, seed=0)]


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "trained" / "models")
