"""A sound card whose output is a file: ALSA's own `file` and `null` plugins, played to by a process of its own."""

import os
import subprocess
import sys

import numpy as np

CONFIG = """
pcm.tape {{ type file slave.pcm "nothing" file "{tape}" format "raw" hint {{ show on description "tape" }} }}
pcm.nothing {{ type null }}
pcm.!default {{ type plug slave.pcm "tape" }}
ctl.!default {{ type hw card 0 }}
"""


def played(folder, script, channels):
    """Run a script in a process whose sound card is the tape; what was written, by channel, and what it printed."""
    tape = folder / "tape.raw"
    (folder / "asound.conf").write_text(CONFIG.format(tape=tape))
    environment = {**os.environ, "ALSA_CONFIG_PATH": str(folder / "asound.conf")}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return np.fromfile(tape, dtype="<f4").reshape(-1, channels), done.stdout
