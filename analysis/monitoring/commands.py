"""The verb that watches a lab."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.protocols.extras import demand_packages
from palpate.protocols.wording import count
from palpate.studies.options import JSON, LAB, echo_json, progress_bar

if TYPE_CHECKING:
    import socket

    from palpate.analysis.monitoring.app import Access
    from palpate.analysis.monitoring.watching import Watch


SERVER: dict[str, Any] = {
    "threads": 4, "ident": None, "connection_limit": 500, "channel_timeout": 10, "cleanup_interval": 2,
    "asyncore_use_poll": True,
}  # fmt: skip
"""Settings of the server: an idle connection is closed after 10 s, and 500 of them would be needed to block others."""


@click.command()
@LAB
@click.option("--port", type=click.IntRange(0, 65535), default=8321, show_default=True, help="0 finds a free one.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Any but this machine alone needs a token.")
@click.option("--token", help="At least 16 characters; generated and printed where one is needed and none is given.")
@click.option(
    "--once", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE.html",
    help="Write the page to a file that needs nothing else, and end.",
)  # fmt: skip
@JSON
def monitor(lab: Path, port: int, host: str, token: str | None, once: Path | None, as_json: bool) -> None:
    """Watch a lab on a small web page: sessions, balance of the orders, how its raters answer.

    The page only reads, refreshes itself every two seconds and can be seen from this machine alone, unless --host says
    otherwise. A session that is running is not disturbed. Ctrl-C ends it.

    \b
    Example:
      palpate monitor --lab LAB
      palpate monitor --lab LAB --once monitor.html
    """
    from palpate.analysis.monitoring.app import access_for
    from palpate.analysis.monitoring.watching import MonitorError, Watch

    watch = Watch(lab)
    if once is not None or as_json:
        from palpate.analysis.monitoring.data import as_data
        from palpate.analysis.monitoring.page import Pages
        from palpate.protocols.files import reason, write_text

        with progress_bar(as_json) as watch.progress:
            snapshot = watch.look()
        if once is not None:
            page = Pages().still(snapshot)
            try:
                write_text(once, page)
            except OSError as error:
                raise MonitorError(f"--once {once}: cannot be written ({reason(error)}); name another file") from None
        if as_json:
            echo_json(as_data(snapshot))
        else:
            click.echo(f"{count(len(snapshot.sessions), 'session')}, {len(snapshot.refused)} refused: {once}")
        return
    _serve(watch, host, port, access_for(host, token))


def _serve(watch: Watch, host: str, port: int, access: Access) -> None:
    demand_packages("palpate monitor", "flask", "waitress", hint="--once and --json work without")
    from importlib import import_module

    from palpate.analysis.monitoring.app import make_app

    watch.look(0.0)  # A lab that is none is refused now, not in the page.
    with _listening(host, port) as listening:
        app = make_app(watch, access)
        server = import_module("waitress.server").create_server(app, sockets=[listening], **SERVER)
        # The address for a browser; where the page is served at every address, this machine's name is in it.
        own_port = listening.getsockname()[1]
        import socket
        from urllib.parse import quote

        name = socket.gethostname() if host in {"0.0.0.0", "::"} else host
        secret = f"?token={quote(access.token, safe='')}" if access.token else ""
        address = f"http://[{name}]:{own_port}/{secret}" if ":" in name else f"http://{name}:{own_port}/{secret}"
        click.echo(f"Watching {watch.lab} at {address} (Ctrl-C ends it)")
        try:
            server.run()
        finally:
            server.close()


def _listening(host: str, port: int) -> socket.socket:
    """Return a listening socket at the address. Raises MonitorError where that is impossible."""
    import socket

    from palpate.analysis.monitoring.watching import MonitorError

    if not host.strip():
        raise MonitorError('--host "": an address or name of this machine is expected, as 127.0.0.1; 0.0.0.0 means all')
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        raise MonitorError(
            f"{host}, port {port}: {error.strerror or error}; give another --port (0 finds a free one), "
            "or as --host a name or address of this machine"
        ) from None
