"""The twin's process from its parent's side: started with a pseudo-terminal as a port, ended with its parent."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import palpate
from palpate.devices.device import DeviceError
from palpate.devices.door.link.limits import Limits

MODULE = "palpate.devices.door.firmware.process"
STARTS_S = 60.0
ENDS_S = 5.0


@dataclass
class TwinProcess:
    """The process of a firmware emulator. It lives as long as its standard input is open, and ends safe.

    Like a real device, it does not get Ctrl-C from its host's terminal.
    """

    name: str
    process: subprocess.Popen[bytes] | None = None

    def start(
        self, speed: float, seed: int, limits: Limits, baud: int, log: Path | None = None, more: Sequence[str] = ()
    ) -> str:
        """Start the process, and return the path of its port. Raises DeviceError."""
        settings = {
            "speed": speed, "seed": seed, "baud": baud, "torque-limit": limits.torque_Nm,
            "slope-limit": limits.slope_Nm_deg, "speed-limit": limits.speed_deg_s, **({"log": log} if log else {}),
        }  # fmt: skip
        options = [f"--{name}={value}" for name, value in settings.items()]
        # The same packages as here, wherever this program was started.
        root = str(Path(str(palpate.__file__)).parent.parent)
        path = os.environ.get("PYTHONPATH")
        self.process = subprocess.Popen(
            [sys.executable, "-m", MODULE, *options, *more], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": f"{root}{os.pathsep}{path}" if path else root}, start_new_session=True,
        )  # fmt: skip
        line = b""
        if self.process.stdout is not None and select.select([self.process.stdout], [], [], STARTS_S)[0]:
            line = self.process.stdout.readline()
        try:
            return str(json.loads(line)["port"])
        except (ValueError, KeyError, TypeError):
            raise DeviceError(f"{self.name}: the door's twin did not start (it printed {line!r})") from None

    def end(self) -> None:
        """End the process; it is killed only if it does not end by itself."""
        process, self.process = self.process, None
        if process is None:
            return
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()
        try:
            process.wait(ENDS_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
