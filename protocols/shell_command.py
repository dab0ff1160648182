"""Commands that a user can paste into a terminal."""

from __future__ import annotations

import os
import shlex
import subprocess


def shell_command(*words: object) -> str:
    """Return `palpate WORDS` with every word quoted as this system's shell needs it."""
    command = ["palpate", *map(str, words)]
    return subprocess.list2cmdline(command) if os.name == "nt" else shlex.join(command)
