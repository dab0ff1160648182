"""Labs whose texture_photos and texture_ratings sessions are small: made-up photos on record, simulated raters."""

from __future__ import annotations

import hashlib

from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.record import read
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated
from tests.analysis.features.picture_specimens import write_picture
from tests.analysis.streams.ledgers import DOOR, Written

LIVE = {"kind": "live", "twins": []}
TWINS = {"kind": "simulated", "twins": ["samples", "camera"]}
AT = {"at": "2026-01-01T00:00:00+00:00"}


class Photos(Written):
    """A session of texture_photos in the making."""

    def begin(self, trial, stimulus, attempt=1):
        self.trial, self.attempt = trial, attempt
        self.note("trial_started", {"stimulus": stimulus, "block": "main"})
        self.ask_for("sense")

    def shoot(self, trial, stimulus, pictures, attempt=1, as_="captured"):
        self.begin(trial, stimulus, attempt)
        self.note("reply", {"recorded": True, "seconds": 1.0, "pictures": pictures, "left_out": []})
        self.end(as_)

    def write(self, participant="E001", rig=None):
        header = read(DOOR).header
        stimuli = [
            {"id": f"T0{n}", "columns": {"label": f"wood {n} of 9", "class": "wood" if n < 3 else "foam"}}
            for n in range(1, 10)
        ]
        study = {**header["study"], "study": "texture_photos", "stimuli": stimuli}
        create(self.path, {**header, "participant": participant, "rig": rig or LIVE, "study": study}, AT)
        ledger = open_for_append(self.path, AT)
        try:
            for event in self.events:
                ledger.append(event)
        finally:
            ledger.close({"at": "2026-01-01T00:00:00+00:00", "because": "complete"})


def photos(lab, participant="E001"):
    """A session to be filled."""
    path = lab / "sessions" / f"texture_photos_{participant}_s1.sqlite"
    path.parent.mkdir(parents=True, exist_ok=True)
    return Photos(path)


def taken(lab, texture, light, seed=None, folder="pictures", side=256):
    """A picture kept in the lab, and what a reply says of it."""
    seed = 100 * int(texture[1:]) + light if seed is None else seed
    file = f"{texture}/light{light:02d}-{seed:016x}.png"
    data = write_picture(lab / folder / file, side, seed)
    return {"file": file, "sha256": hashlib.sha256(data).hexdigest(), "light": light, "flags": []}


def rated_by(lab, people, textures=("T01", "T02", "T03"), **changes):
    """Simulated sessions of texture_ratings with these textures."""
    loaded = read_study(SHIPPED / "texture_ratings" / "study.yaml")
    definition = loaded.study.definition()
    stimuli = [stimulus for stimulus in definition["stimuli"] if stimulus["id"] in textures]
    study = loaded.study.model_validate({**definition, "opening": [], "stimuli": stimuli, **changes})
    paths = []
    for row, name in enumerate(people):
        plan = compile_plan(study, ParticipantRow(name, None, row % 2))
        paths.append(start(lab, plan, simulated(study, loaded.folder)).path)
    return paths
