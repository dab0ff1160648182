"""Commands run in the process of the test, and what they print."""

import re

from click.testing import CliRunner, Result


def run(command, *arguments) -> Result:
    """Run a command; what it raises comes through."""
    return CliRunner().invoke(command, [str(argument) for argument in arguments], catch_exceptions=False)


def text(result: Result) -> str:
    """Return what was printed by a command that succeeded, each run of blanks as one."""
    assert result.exit_code == 0, result.output
    return re.sub(r"\s+", " ", result.stdout)
