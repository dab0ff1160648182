"""Run `palpate streams` as a user does."""

from palpate.analysis.streams.commands import streams
from tests.commands_for_tests import run_verb


def output_of(*arguments, status=0):
    """Run `palpate streams ...`, check its exit status and return what it prints."""
    return run_verb(streams, *arguments, status=status).output
