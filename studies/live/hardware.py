"""The devices of a live session: those of the station's rig, or simulated ones in their place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from palpate.protocols.needs import NEEDS, presented_by_device
from palpate.protocols.plan import Plan
from palpate.protocols.study import Study
from palpate.studies.catalogue import StudyFiles
from palpate.studies.live.options import LiveOptions
from palpate.studies.live.world import Station, TwinInRealTime, compose_station
from palpate.studies.sessions.rig import RigError

if TYPE_CHECKING:
    from palpate.devices.render.window.tablet_screen import TabletScreen
    from palpate.devices.rig.file import RigFile
    from palpate.devices.rig.opened import OpenRig
    from palpate.devices.tablet.device import Display


def driven(study: Study) -> list[str]:
    """Return the study's needs that devices of a rig serve; samples are placed by hand if the rig has no stage."""
    return [need for need in study.needs if NEEDS[need].role is not None]


@dataclass
class Hardware:
    """The devices of one study at one station; `twins` are the needs that are simulated in this process."""

    study_files: StudyFiles
    lab: Path
    twins: Sequence[str] = ()
    file: RigFile | None = None
    opened: OpenRig | None = None
    tablet: TabletScreen | None = None
    description: dict[str, Any] = field(default_factory=dict)
    recorded: Mapping[str, Any] = field(default_factory=dict)
    """How each device described itself when the resumed session was started; {} for a new one."""

    @property
    def simulated_needs(self) -> list[str]:
        """The needs that are simulated, in this process or by the rig's twins; every record names them."""
        if self.file is None:
            return list(self.twins)
        file = self.file
        return [need for need in self._needs() if any(file.is_twin(name) for name in file.names_for(need))]

    def settings(self) -> dict[str, Any]:
        """Return the rig file's settings of the devices in use, for the ledger: {name: settings}."""
        return {} if self.file is None else self.file.definition(self._names())

    def open(self, plan: Plan) -> None:
        """Check the stimuli and open the devices. Raises RigError or DeviceError, with no device left open."""
        needs = [NEEDS[need] for need in self.study_files.study.needs]
        presented = any(need.role == "presents" for need in needs)
        by_rig = self.file is not None and presented_by_device(self.study_files.study.needs)  # by its limits, below
        if (self.simulated_needs or presented) and not by_rig:  # what is presented comes from files: they may be wrong
            from palpate.studies.simulation.rig import simulated

            simulated(self.study_files.study, self.study_files.folder, self.lab).check(plan)
        if self.file is not None:
            from palpate.devices.rig.opened import open_rig
            from palpate.studies.live.daily_dose import demand_dose
            from palpate.studies.live.station import demand_follows, demand_within_limits

            self.opened = open_rig(self.file, self._names())
            try:
                demand_dose(self.opened, plan, self.lab)
                self.description.update(self.opened.describe())
                demand_within_limits(self.opened, self.study_files, plan)
                demand_follows(self.opened, plan, self.recorded)
                self._open_tablet(plan)
            except BaseException:
                self.close()
                raise

    def safe(self) -> None:
        """Bring every device to rest; do nothing if none is open."""
        if self.opened is not None:
            self.opened.safe()

    def close(self) -> None:
        """Make every device safe and close it; do nothing if none is open."""
        opened, self.opened = self.opened, None
        tablet, self.tablet = self.tablet, None
        try:
            if opened is not None:
                opened.close()
        finally:
            if tablet is not None:
                tablet.close()

    def station(self, plan: Plan) -> Station:
        """Return the station of what presents and what records. Call it once the devices are open."""
        if self.opened is not None:
            from palpate.studies.live.station import rig_station

            return rig_station(self.opened, self.study_files, plan, self.lab, self.tablet)
        return twin_station(plan, self.study_files.folder, self.twins, self.lab)

    def changed_firmware(self) -> list[str]:
        """Return sentences for the record that name devices whose firmware has changed since the session's start."""
        pairs = {name: (self.recorded.get(name, {}).get("firmware"), now.get("firmware"))
                 for name, now in self.description.items()}  # fmt: skip
        return [
            f"The firmware of {name} was {before} when the session was started, and is {now}."
            for name, (before, now) in pairs.items()
            if before is not None and before != now
        ]

    def demand_other_screen(self, screen: int) -> None:
        """Raise RigError if the tablet is to use the screen that the participant's window is on."""
        display = self._tablet_display()
        if display is not None and display.number == screen:
            raise RigError(
                f"screen {screen} is the participant's window's, and the tablet's as well by the rig file: give the"
                " tablet the number of its own screen (screen: {number: N, ...}), or leave its `screen` out"
            )

    def _tablet_display(self) -> Display | None:
        """Return the display of the renderer's tablet if the rig file says that it is a screen, else None."""
        if self.file is None or "texture_renderer" not in self.study_files.study.needs:
            return None
        names = self.file.names_for("texture_renderer")
        settings: Any = next(self.file.devices[name] for name in names if self.file.kind(name) == "tablet")
        return cast("Display | None", settings.screen)

    def _open_tablet(self, plan: Plan) -> None:
        """Open the dark window on the tablet's screen if the tablet is one. Raises DeviceError."""
        if (display := self._tablet_display()) is None:
            return
        from palpate.devices.device import DeviceError
        from palpate.devices.render.window.tablet_screen import TabletScreen
        from palpate.signals.textures.sounds import RenderError
        from palpate.studies.live.renderer import demand_pictures

        demand_pictures(plan, self.study_files.folder, self.lab)
        try:
            self.tablet = TabletScreen(display).__enter__()
        except RenderError as error:
            raise DeviceError(str(error)) from None

    def _needs(self) -> list[str]:
        """Return the needs that the rig serves."""
        needs = driven(self.study_files.study)
        stage = "samples" in self.study_files.study.needs and self.file is not None and "samples" in self.file.needs
        return [*needs, *(["samples"] if stage else [])]

    def _names(self) -> list[str]:
        """Return the names of the devices to open, each once."""
        if self.file is None:
            return []
        return list(dict.fromkeys(name for need in self._needs() for name in self.file.names_for(need)))


def hardware_for(study_files: StudyFiles, lab: Path, options: LiveOptions) -> Hardware:
    """Return the devices for a live session of the study.

    Raises RigError without a rig file and stand-ins, RigFileError where a device is missing in the file.
    """
    needs = driven(study_files.study)
    if options.twins:
        return Hardware(study_files, lab, twins=[need for need in needs if NEEDS[need].role != "beside"])
    file = _rig_file(study_files.study, lab, options.rig)
    if file is None:
        return Hardware(study_files, lab)
    for need in needs:
        file.names_for(need)
    return Hardware(study_files, lab, file=file)


def _rig_file(study: Study, lab: Path, given: Path | None) -> RigFile | None:
    """Read the station's rig; None if the study needs no device and no file is given."""
    from palpate.devices.rig.file import read_rig, rig_path

    path = given or rig_path(lab)
    if given is None and not path.is_file():
        if not driven(study):
            return None
        named = ", ".join(need.replace("_", " ") for need in driven(study))
        raise RigError(
            f"{study.study} needs {named}, and this station has no rig file {path}: write one (palpate rig simulate "
            "begins with twins). Or rehearse the procedure with simulated devices and a real window: --twins (every "
            "record says so); or without a participant: --simulate"
        )
    return read_rig(path)


def twin_station(plan: Plan, folder: Path, twins: Sequence[str], lab: Path | None = None) -> Station:
    """Return a station of the study's simulated devices; a stimulus that no device presents is placed by hand."""
    by_twin: dict[str, TwinInRealTime] = {}
    if twins:
        from palpate.studies.simulation.twins import twin_for

        twin = twin_for(plan.study, plan, folder, lab=lab)
        by_twin = {name: TwinInRealTime(name, twin) for name in twins}
    device = next((twin for name, twin in by_twin.items() if NEEDS[name].role == "presents"), None)
    records = {name: twin for name, twin in by_twin.items() if NEEDS[name].role == "records"}
    return compose_station(plan.study, device, records)
