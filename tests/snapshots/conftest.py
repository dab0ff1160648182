"""What a terminal is to all snapshots: 100 characters wide, without colours, on no display."""

import click
import pytest

from tests.commands_for_tests import run_command
from tests.snapshots.texts import WIDTH, make_lab


@pytest.fixture(scope="session")
def rebuilt(tmp_path_factory):
    """The database of the frozen lab as it is rebuilt today, to be copied into a copy of the lab."""
    folder = tmp_path_factory.mktemp("rebuilt")
    make_lab(folder)
    code, _, error = run_command("collect", "--rebuild", "--lab", folder / "LAB")
    assert code == 0, error
    return folder / "LAB" / "lab.sqlite"


@pytest.fixture(autouse=True)
def plain_terminal(monkeypatch):
    for name, value in {"COLUMNS": str(WIDTH), "NO_COLOR": "1", "TERM": "dumb", "LINES": "50"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("DISPLAY", raising=False)
    help_option = click.Command.get_help_option

    def anew(command, context):
        """Return the help option of this run: a command keeps that of its first run in a process, a test's own."""
        command._help_option = None
        return help_option(command, context)

    monkeypatch.setattr(click.Command, "get_help_option", anew)


@pytest.fixture(scope="module", autouse=True)
def coarse_pictures():
    """Write pictures beside the SVG with few pixels while these files are run: nothing here reads them."""
    from matplotlib.figure import Figure

    def save(figure, *place, **options):
        return whole(figure, *place, **options | ({"dpi": 20} if options.get("format") == "png" else {}))

    with pytest.MonkeyPatch.context() as patch:
        whole = Figure.savefig
        patch.setattr(Figure, "savefig", save)
        yield
