"""The console script, and `python -m palpate`.

An interrupt (Ctrl-C) ends the program with a message at any moment, also while it is imported.
"""

from __future__ import annotations

import _thread
import os
import signal
import sys

INTERRUPTED = 130


def main() -> None:
    """Import the front door and the room of the command, then run the command line and exit."""
    earlier_handler = signal.getsignal(signal.SIGINT)
    handles_interrupt = earlier_handler is signal.default_int_handler
    if handles_interrupt:
        signal.signal(signal.SIGINT, _exit_at_once)
        sys.unraisablehook = _raise_again
    try:
        from palpate import command_line

        if len(sys.argv) > 1:
            command_line.import_room(sys.argv[1])
        if handles_interrupt:
            signal.signal(signal.SIGINT, earlier_handler)
        command_line.main()
    except KeyboardInterrupt:
        _exit_at_once()
    finally:
        if handles_interrupt:
            signal.signal(signal.SIGINT, signal.SIG_DFL)


def _exit_at_once(*_: object) -> None:
    """End at once: nothing has been opened or written yet, or everything has been closed."""
    os.write(2, b"stopped\n")
    os._exit(INTERRUPTED)


def _raise_again(unraisable: sys.UnraisableHookArgs) -> None:
    """Raise an interrupt again that came while Python could not raise it, as in a callback of the import system."""
    if unraisable.exc_type is KeyboardInterrupt:
        _thread.interrupt_main()
    else:
        sys.__unraisablehook__(unraisable)


if __name__ == "__main__":
    main()
