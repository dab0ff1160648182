"""The processes of door twins that this process started."""

import os
from pathlib import Path


def children():
    """Return the processes of twins that this process started."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes().split(b"\0")
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError, IndexError):
            continue
        if parent == os.getpid() and b"palpate.devices.door.firmware.process" in words:
            yield int(folder.name)
