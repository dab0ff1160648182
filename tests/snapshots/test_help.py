"""The help of every command and of every group of commands, word by word."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tests.snapshots.texts import ROOT, WIDTH, command_line, compare

PRINT_HELP = """
import json, sys
from tests.snapshots.texts import command_line
import click
pages = {}
def walk(name, command):
    with click.Context(command, info_name=name, terminal_width=int(sys.argv[1])) as context:
        context.help_option_names = ["-h", "--help"]
        pages[name] = command.get_help(context)
        for inner in command.list_commands(context) if isinstance(command, click.Group) else ():
            walk(f"{name} {inner}", command.get_command(context, inner))
walk("palpate", command_line.cli)
json.dump(pages, sys.stdout)
"""
"""In a process of its own, because click caches the first help option of a command."""


@pytest.fixture(scope="module")
def help_pages():
    done = subprocess.run([sys.executable, "-c", PRINT_HELP, str(WIDTH)], capture_output=True, check=True, cwd=ROOT)
    return json.loads(done.stdout)


def test_the_front_page_is_unchanged(help_pages):
    compare("help/palpate", help_pages["palpate"] + "\n")


@pytest.mark.parametrize("verb", command_line.VERBS)
def test_the_help_of_every_command_is_unchanged(verb, help_pages):
    pages = [page for name, page in help_pages.items() if name.split()[1:2] == [verb]]
    compare(f"help/{verb}", "\n\n\n".join(pages) + "\n")
