"""Pictures copied into the lab: by sample, light and content, never written over, on disk before they are told of."""

from __future__ import annotations

import os
import re
from pathlib import Path

from devices.signals import DeviceFault
from protocols.canonical import digest


def keep(device: str, pictures: Path, stimulus: str, light: int, sha256: str, name: str, data: bytes) -> str:
    """Copy a picture; its path below `pictures`, as T07/light03-0123456789abcdef.jpg.

    Raises DeviceFault where the disk takes it not.
    """
    suffix = Path(name).suffix.lower()
    path = pictures / folder_of(stimulus) / f"light{light:02d}-{sha256[:16]}{suffix}"
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        _remove(part)
        told = f"{device}: {name} cannot be kept in {path.parent}: {error.strerror}"
        raise DeviceFault(device, "refused", told) from None
    return path.relative_to(pictures).as_posix()


def folder_of(stimulus: str) -> str:
    """A stimulus' folder: its id where that is a plain name, else what is plain of it and a digest."""
    if re.fullmatch(r"[A-Za-z0-9_-]{1,64}", stimulus):
        return stimulus
    return f"{re.sub(r'[^A-Za-z0-9_-]+', '_', stimulus)[:40]}-{digest(stimulus)[:8]}"


def _remove(part: Path) -> None:
    """What was begun; where even that fails, it is left and never counted."""
    try:
        part.unlink(missing_ok=True)
    except OSError:
        return
