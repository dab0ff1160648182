"""Pictures copied into the lab: by sample, light and content, never written over, on disk before they are told of."""

from __future__ import annotations

import re
from pathlib import Path

from palpate.devices.signals import DeviceFault
from palpate.protocols.canonical import digest
from palpate.protocols.files import reason, write_bytes


def keep(device: str, pictures: Path, stimulus: str, light: int, sha256: str, name: str, data: bytes) -> str:
    """Copy a picture; its path below `pictures`, as T07/light03-0123456789abcdef.jpg.

    Raises DeviceFault where the disk takes it not.
    """
    suffix = Path(name).suffix.lower()
    path = pictures / folder_of(stimulus) / f"light{light:02d}-{sha256[:16]}{suffix}"
    try:
        write_bytes(path, data)
    except OSError as error:
        told = f"{device}: {name} cannot be kept in {path.parent}: {reason(error)}"
        raise DeviceFault(device, "refused", told) from None
    return path.relative_to(pictures).as_posix()


def folder_of(stimulus: str) -> str:
    """A stimulus' folder: its id where that is a plain name, else what is plain of it and a digest."""
    if re.fullmatch(r"[A-Za-z0-9_-]{1,64}", stimulus):
        return stimulus
    return f"{re.sub(r'[^A-Za-z0-9_-]+', '_', stimulus)[:40]}-{digest(stimulus)[:8]}"
