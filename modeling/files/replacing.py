"""The two files of a model, NAME.json (its card) and NAME.safetensors (its numbers), replaced as one."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from palpate.protocols.files import staged_files, write_bytes

NUMBERS = ".safetensors"


class ModelWritingError(ValueError):
    """A model that is not written: the message says which, what was found and what is expected."""


def replace_model(card: Path, text: bytes, content: bytes, renamed: Callable[[str], bytes | None]) -> Path:
    """Put a card's text and the content of its numbers in place when both are on the disk; return the card's path.

    Whenever the writing is cut off, the card that is there belongs to numbers that are there: an earlier card is first
    made to name a copy of its numbers. `renamed(file)` returns that card with its numbers in `file`; None where there
    is none that can be read, or it names such a copy already.

    Raises ModelWritingError for files that do not read back as they were written, and OSError. Both leave the earlier
    model whole.
    """
    numbers = card.with_name(f"{card.stem}{NUMBERS}")
    copy = card.with_name(f"{card.stem}~replaced{NUMBERS}")  # no model can have this name
    files = {numbers.name: content, card.name: text}

    def check(draft: Path) -> None:
        for name, expected in files.items():
            _require_kept(draft / name, expected, card.with_name(name))
        _free_numbers(card, numbers, copy, renamed(copy.name))

    with staged_files(card.parent, last=[card.name], check=check) as draft:
        for name, expected in files.items():
            write_bytes(draft / name, expected)
    copy.unlink(missing_ok=True)
    return card


def _free_numbers(card: Path, numbers: Path, copy: Path, renamed: bytes | None) -> None:
    """Let the earlier card name a copy of its numbers, so that their own name is free."""
    if renamed is None or not numbers.is_file():
        return
    earlier = numbers.read_bytes()
    try:
        write_bytes(copy, earlier, lambda draft: _require_kept(draft, earlier, copy))
        write_bytes(card, renamed, lambda draft: _require_kept(draft, renamed, card))
    except BaseException:
        with suppress(OSError):
            if card.read_bytes() != renamed:  # else the card is in place, and only its folder could not be synced
                copy.unlink(missing_ok=True)
        raise


def _require_kept(draft: Path, content: bytes, path: Path) -> None:
    if draft.read_bytes() != content:
        raise ModelWritingError(f"{path}: it does not read back as it was written, and was not replaced.")
