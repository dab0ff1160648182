"""Run commands as a user does, and return what the user gets."""

from __future__ import annotations

import contextlib
import io
from typing import Any

import pytest
from click import Command
from click.testing import CliRunner, Result

from palpate import command_line


def run_command(*arguments: object) -> tuple[int, str, str]:
    """Run `palpate ...` and return its exit code, output and errors."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as ended:
        command_line.main([str(argument) for argument in arguments])
    return int(ended.value.code or 0), out.getvalue(), err.getvalue()


def run_verb(verb: Command, *arguments: object, status: int = 0, obj: Any = None) -> Result:
    """Run one verb in this process, with `obj` as its context, check its exit status and return click's result."""
    result = CliRunner().invoke(verb, [str(argument) for argument in arguments], obj=obj, catch_exceptions=False)
    assert result.exit_code == status, result.output
    return result
