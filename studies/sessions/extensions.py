"""The extensions that a session's study and rig name: what its first event says of them, and what has changed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from palpate.protocols.extensions import ExtensionError, MissingExtension, described, extensions_in, finder
from palpate.protocols.reading import own_parts
from palpate.protocols.study import Study

KEY = "extensions"


class ExtensionsChanged(ValueError):
    """An extension is not the one that the session, or the sample, was made with."""


def extensions_of_study(study: Study) -> tuple[str, ...]:
    """Return the names of the extensions whose parts a study names."""
    return extensions_in(name for _, _, name in own_parts(study))


def extensions_of_session(study: Study, rig: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the extensions whose parts a study, or a rig as the first event describes it, names."""
    kinds = [settings.get("kind") for settings in (rig.get("settings") or {}).values()]
    return tuple(sorted({*extensions_of_study(study), *extensions_in(kinds)}))


def definitions(names: Iterable[str]) -> dict[str, dict[str, str]]:
    """Return what a ledger stores of these extensions: version, SHA-256 and package. Raises ExtensionError."""
    return {name: finder().load(name).definition() for name in names}


def demand_here(header: Mapping[str, Any], names: Iterable[str]) -> None:
    """Raise ExtensionError for the first of these extensions that is not here, with how to get the recorded one."""
    for name in names:
        try:
            finder().load(name)
        except ExtensionError as error:
            if (before := header.get(KEY, {}).get(name)) is None:
                raise
            made = f"made with the extension {described(name, before)}"
            if not isinstance(error, MissingExtension):
                raise ExtensionError(f"{made}: {error}") from None
            package = before.get("package")
            get = (
                f"pip install {package}=={before['version']}" if package else f"put {name}.py back into LAB/extensions"
            )
            raise MissingExtension(f"{made}, which is not here: {get}") from None


def differences(header: Mapping[str, Any], names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return those of these extensions that are not as the header says, each as recorded and as it is now."""
    recorded, now = header.get(KEY, {}), definitions(names)
    return {
        name: {"before": recorded[name], "now": now[name]}
        for name in now
        if name in recorded and recorded[name]["sha256"] != now[name]["sha256"]
    }


def in_words(changed: Mapping[str, Mapping[str, Any]]) -> str:
    """Return these differences in words."""
    return "; ".join(f"{described(n, c['before'])} is {described(n, c['now'])} now" for n, c in changed.items())


def demand_same_extensions(header: Mapping[str, Any], names: Iterable[str], accept: bool) -> dict[str, Any] | None:
    """Return what goes on record if one of these extensions has changed since `header` was written, else None.

    Raises ExtensionError if one is missing, ExtensionsChanged naming the changes unless they are accepted.
    """
    names = tuple(names)
    demand_here(header, names)
    if not (changed := differences(header, names)):
        return None
    if not accept:
        raise ExtensionsChanged(
            f"{header['study']['study']}: code has changed since participant {header['participant']} began session "
            f"{header['session']}: {in_words(changed)}. Put it back as it was, or accept the change with "
            "--accept-change, which is recorded"
        )
    return {"extensions_changed": changed}
