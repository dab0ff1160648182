"""Changes of a study or a screen since a participant began: refused by name, or accepted and recorded."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.protocols.canonical import canonical, digest
from palpate.protocols.files import file_sha256
from palpate.protocols.study import Study, conditions_of
from palpate.studies.collecting.study_sessions import headers_of
from palpate.studies.sessions.model_versions import SHOWN, models_before, models_in
from palpate.studies.sessions.record import read_header
from palpate.studies.sessions.session_files import in_person, ledger_path

if TYPE_CHECKING:
    from palpate.devices.window.calibration import Calibration

MOST_NAMED = 3
LONGEST = 60
NAMES = ("id", "name", "word", "low")
"""The keys that name the items of a study's lists."""


class StudyChanged(ValueError):
    """The study is not the one that the participant began with."""


class ModelsChanged(ValueError):
    """The models are not those that the session, or the sample, was played with."""


class ScreenChanged(ValueError):
    """The screen is not the one that the session was started on."""


class DevicesChanged(ValueError):
    """The devices are not those that the session was started with."""


def study_change(recorded: Mapping[str, Any], current: Study) -> str | None:
    """Return the first differences of the study from its recorded definition, in plain words; None if it is the same.

    Only what a participant experiences is compared, not the sample, the planned minutes or the questions.
    """
    changes = list(differences(conditions_of(recorded), current.conditions()))
    if not changes:
        return None
    more = f"; and {len(changes) - MOST_NAMED} more" if len(changes) > MOST_NAMED else ""
    return "; ".join(changes[:MOST_NAMED]) + more


def demand_unchanged(header: Mapping[str, Any], current: Study, accept: bool) -> dict[str, Any] | None:
    """Return what goes on record if the study has changed since `header` was written, else None.

    `header` is the first event's body of the session, of the participant's earlier session, or else of the sample's
    latest one.
    Raises StudyChanged naming the differences, unless they are accepted.
    """
    change = study_change(header["study"], current)
    if change is None:
        return None
    before, now = digest(conditions_of(header["study"])), digest(current.conditions())
    if not accept:
        raise StudyChanged(
            f"{current.study}: the study has changed since participant {header['participant']} began session "
            f"{header['session']} (digest {before[:SHOWN]}, now {now[:SHOWN]}): {change}. Put it back as it was, or "
            "accept the change for this participant with --accept-change, which is recorded"
        )
    since = {"since_participant": header["participant"], "since_session": header["session"]}
    return {**since, "study_before": before, "study_now": now, "differences": change}


def earlier_header(lab: Path, study: str, participant: str, number: int) -> dict[str, Any] | None:
    """Return the first event's body of the participant's latest session before this one, None if there is none."""
    for earlier in range(number - 1, 0, -1):
        path = ledger_path(lab, study, participant, earlier)
        if path.is_file():
            return read_header(path)
    return None


def sample_ledgers(lab: Path, study: str, real: bool) -> list[Path]:
    """Return the ledgers of a study's real or simulated sessions, the most recently written first.

    Those of people who withdrew, and those whose first event cannot be read, are left out.
    """
    headers = headers_of(lab, study)
    ledgers = [path for path, header in headers if header is not None and in_person(header) == real]
    return sorted(ledgers, key=lambda path: path.stat().st_mtime_ns, reverse=True)


def models_now(study: Study, lab: Path | None) -> dict[str, str]:
    """Return the SHA-256 of each model that the study would play now, by name; models that are missing are left out.

    Raises ModelFileError on a model of doors that cannot be read.
    """
    models: dict[str, str] = {}
    if "texture_renderer" in study.needs:
        from palpate.devices.render.texture_models import SHIPPED, available

        cards = available(lab or SHIPPED)
        for stimulus in study.stimuli:
            texture, method = stimulus.columns.get("texture", ""), stimulus.columns.get("model", "")
            if (card := cards.get(texture, {}).get(method)) is not None:
                models[card.stem] = file_sha256(card)
    if "door_generator" in study.needs:
        from palpate.devices.door.making import maker_for

        models |= models_in({"made": {"models": maker_for(lab).identity}})
    return models


def demand_same_models(study: Study, lab: Path, ledgers: Iterable[Path], accept: bool) -> dict[str, Any] | None:
    """Return what goes on record if a model has changed since `ledgers` last played it, else None.

    Raises ModelsChanged naming the models and both digests, unless the change is accepted.
    """
    now = models_now(study, lab)
    before = models_before(now, ledgers)
    changed = {name: (*before[name], now[name]) for name in sorted(before) if before[name][0] != now[name]}
    if not changed:
        return None
    if not accept:
        shown = [
            f"{name} was {old[:SHOWN]} in {path.name} and is {new[:SHOWN]}"
            for name, (old, path, new) in list(changed.items())[:MOST_NAMED]
        ]
        more = f"; and {len(changed) - MOST_NAMED} more" if len(changed) > MOST_NAMED else ""
        raise ModelsChanged(
            f"{study.study}: models have changed under their names: {'; '.join(shown)}{more}. Put them back as they "
            "were, or accept the change with --accept-change, which is recorded"
        )
    return {"models_changed": {name: {"before": old, "now": new} for name, (old, _, new) in changed.items()}}


def demand_same_screen(header: Mapping[str, Any], now: Calibration, accept: bool) -> dict[str, Any] | None:
    """Return what goes on record if a session is resumed on another screen, else None.

    A screen is the same if its size in pixels is, and if 127 mm on it agree within half a millimetre. Raises
    ScreenChanged unless the change is accepted.
    """
    from palpate.devices.window.calibration import TOLERANCE_MM

    if (before := header.get("calibration")) is None:
        return None
    drawn_mm = now.nominal_mm * now.px_per_mm / before["px_per_mm"]
    if tuple(before["size_px"]) == now.size_px and abs(drawn_mm - now.nominal_mm) <= TOLERANCE_MM:
        return None
    if not accept:
        raise ScreenChanged(
            f"the session was started on a screen of {_screen(before)}, this has {_screen(now.definition())}: resume "
            "where it was started, or accept the change with --accept-change, which is recorded"
        )
    return {"calibration_before": dict(before), "calibration_now": now.definition()}


def demand_same_devices(header: Mapping[str, Any], now: Mapping[str, Any], accept: bool) -> dict[str, Any] | None:
    """Return what goes on record if a session is resumed with other devices or settings, else None.

    Ports are not compared. Raises DevicesChanged naming the differences unless it is accepted.
    """
    before, after = _unplugged(header["rig"].get("settings")), _unplugged(now.get("settings"))
    changes = list(differences(before, after))
    if not changes:
        return None
    shown = "; ".join(changes[:MOST_NAMED])
    if not accept:
        raise DevicesChanged(
            f"the rig has changed since the session was started: {shown}. Put it back as it was, or accept the change "
            "with --accept-change, which goes on record"
        )
    return {"settings_before": before, "settings_now": after, "devices_changed": shown}


def _unplugged(settings: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return settings without ports; a setting that is None counts as missing, as in versions before it existed."""
    return {
        name: {key: value for key, value in given.items() if key != "port" and value is not None}
        for name, given in (settings or {}).items()
    }


def _screen(calibration: Mapping[str, Any]) -> str:
    width, height = calibration["size_px"]
    return f"{width}x{height} px at {calibration['px_per_mm']:.3f} px/mm"


def differences(before: Any, now: Any, place: str = "") -> Iterator[str]:
    """Yield every difference of two definitions in plain words, keys in order; items of lists are matched by name."""
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        yield from _of_mappings(before, now, place)
    elif _is_list(before) and _is_list(now):
        yield from _of_lists(before, now, place)
    elif canonical(before) != canonical(now):
        yield f"{place} was {_short(before)} and is {_short(now)}"


def _of_mappings(before: Mapping[str, Any], now: Mapping[str, Any], place: str) -> Iterator[str]:
    for key in sorted({*before, *now}):
        inner = f"{place}.{key}" if place else key
        if key not in now:
            yield f"{inner} was {_short(before[key])} and is gone"
        elif key not in before:
            yield f"{inner} is new: {_short(now[key])}"
        else:
            yield from differences(before[key], now[key], inner)


def _of_lists(before: Sequence[Any], now: Sequence[Any], place: str) -> Iterator[str]:
    old, new = _named(before), _named(now)
    if old is None or new is None:
        if canonical(before) != canonical(now):
            yield f"{place} was {_short(before)} and is {_short(now)}"
        return
    changes = list(_of_mappings(old, new, place))
    if not changes and list(old) != list(new):
        changes = [f"{place} is in another order"]
    yield from changes


def _named(items: Sequence[Any]) -> dict[str, Any] | None:
    """Return items by name; None if they have no names, or a name occurs twice."""
    names = [next((str(item[key]) for key in NAMES if key in item), "") for item in items if isinstance(item, Mapping)]
    if len(names) < len(items) or "" in names or len(set(names)) < len(names):
        return None
    return dict(zip(names, items, strict=True))


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _short(value: Any) -> str:
    text = canonical(value).decode()
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
