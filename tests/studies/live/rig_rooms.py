"""A rig of twins for tests, a room with simulated people in real time, and small studies to run there."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.protocols.events import Ask, Present, Reply
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, StudyFiles, read_study
from palpate.studies.live.opening import live_plan
from palpate.studies.live.options import LiveOptions
from palpate.studies.sessions.session import start

DOORS = read_study(SHIPPED / "door_ratings" / "study.yaml")
TWINS = """rig: twins
devices:
  door: {kind: door, driver: twin, twin_speed: 0.25}
  vibration: {kind: accelerometer, driver: twin, rate_hz: 3000}
  force: {kind: force_torque, driver: twin, rate_hz: 8000}
  tracker: {kind: tracker, driver: twin, rate_hz: 120}
  noise: {kind: masking_noise, driver: twin}
  camera: {kind: camera, driver: twin}
  stage: {kind: stage, driver: twin, mount_s: 0}
needs:
  door: [door]
  door_generator: [door]
  tool: [vibration, force, tracker]
  camera: [camera]
  masking_noise: [noise]
  samples: [stage]
"""
TEXTURE_TWINS = """rig: twins
devices:
  stylus: {kind: tablet, driver: twin}
  actuator: {kind: voice_coil, driver: twin}
  noise: {kind: masking_noise, driver: twin, db_spl_at_0_dbfs: 100}
needs:
  texture_renderer: [stylus, actuator]
  masking_noise: [noise]
"""


@dataclass
class Room:
    """A presenter in real time: people answer at once, pages stay until they are done with; `meanwhile` may meddle.

    `mend` is done once whenever a device is to be put right: a machine that is busy may also lose a heartbeat.
    """

    person: Perceiver
    meanwhile: Callable[[str, int], None] = lambda _page, _looks: None
    mend: Callable[[], object] = lambda: None
    description: Mapping[str, Any] = field(default_factory=lambda: {"room": True})
    on_side: Callable[[str], None] | None = None
    looks: int = 0
    felt: Present | None = None
    felt_from: int = 0

    def perform(self, request, desk, now_ns):
        if (aside := desk.poll()) is not None:
            return aside
        return Reply(self.person.answer(request)[0].value if isinstance(request, Ask) else {})

    def wait_for(self, key, desk, ready):
        until = time.monotonic() + 60
        if key == "changing_sample" and not ready():
            self.mend()
        while not ready():
            assert time.monotonic() < until, f"still waiting at {key}"
            self.looks += 1
            self.meanwhile(key, self.looks)
            if (aside := desk.poll()) is not None:
                return aside
            time.sleep(0.004)
        return None

    def show_live(self, request, desk, ready, moved):
        """One line of the form that is felt is moved at every look, 25 times; some looks later the door is stopped."""
        name, value = next(iter(request.wish.items()))
        if self.felt is not request:
            self.felt, self.felt_from = request, self.looks

        def looked():
            looks = self.looks - self.felt_from
            moved({name: (value + min(looks, 25)) % 100}, looks > 300)
            return ready()

        return self.wait_for("live", desk, looked)

    def finish(self, desk=None, page="end"):
        pass

    def close(self):
        pass


def doors(count=1, **changes) -> StudyFiles:
    stimuli = [s.model_dump() for s in DOORS.study.stimuli if s.columns["variant"] == "g0"][:count]
    given = {"stimuli": stimuli, "groups": {}, "opening": (), "rest": None, "order": {"design": "as_listed"}, **changes}
    given |= {"analysis": None, "practice": None, "instructions": None}
    return StudyFiles(Study.model_validate(DOORS.study.definition() | given), DOORS.folder)


def live_doors(folder, practice=True) -> StudyFiles:
    """The shipped authoring study with a door that follows the sliders, written to a folder; without its opening."""
    shipped = SHIPPED / "door_authoring"
    text = (shipped / "study.yaml").read_text(encoding="utf-8")
    text = text.replace("study: door_authoring", "study: door_live\nlive: {show_force: true}")
    text = text.replace("opening: [consent, demographics]\n", "")
    text = text if practice else text.replace("practice: {stimuli: [free]}\n", "")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    (folder / "stimuli.csv").write_bytes((shipped / "stimuli.csv").read_bytes())
    return read_study(folder / "study.yaml")


def captures(**changes) -> StudyFiles:
    given = {
        "study": "quick", "task": "capture", "stimuli": [{"id": "T15"}, {"id": "T36"}], "needs": ["tool", "samples"],
        "capture": {"device": "tool", "seconds": 1.0}, "order": {"design": "as_listed"},
    }  # fmt: skip
    return StudyFiles(Study.model_validate(given | changes), SHIPPED / "texture_capture")


def plan_of(study_files):
    return compile_plan(study_files.study, ParticipantRow("P001"))


def run_live(study_files, lab, **options):
    return start(lab, plan_of(study_files), live_plan(study_files, lab, LiveOptions(**options)))


def kinds(record):
    return [event.kind for event in record.events]


def ends(record):
    return [event.value["as"] for event in record.events if event.kind == "trial_ended"]


def counting_outcomes(record):
    """How the trials ended, those left out that a busy machine's missing heartbeat broke off."""
    return [how for how in ends(record) if how != "faulted"]
