"""The designer's window with a maker that needs no model: `python -m tests.devices.author.program LAB`."""

import sys
from pathlib import Path

from palpate.devices.author.app import run_window
from palpate.devices.window.app import WindowOptions
from tests.devices.author.fakes import FakeMaker

RIG = """
rig: test
devices:
  door: {kind: door, driver: twin, twin_speed: 0.3}
needs:
  door_generator: [door]
"""


def main(lab):
    rig = Path(lab) / "rig.yaml"
    rig.write_text(RIG, encoding="utf-8")
    run_window(FakeMaker(), WindowOptions(lab=Path(lab), rig=rig))


if __name__ == "__main__":
    main(*sys.argv[1:])
