"""The server of the monitor answers while others hold connections open that ask nothing."""

import socket
import threading
from contextlib import ExitStack
from importlib import import_module

import pytest

from palpate.analysis.monitoring.commands import SERVER, _listening
from palpate.analysis.monitoring.watching import MonitorError

pytestmark = pytest.mark.needs("flask")


def answer(_environment, start):
    start("200 OK", [("Content-Length", "5")])
    return [b"hello"]


def test_half_open_connections_keep_nobody_waiting():
    with _listening("127.0.0.1", 0) as listening, ExitStack() as open_ones:
        address = listening.getsockname()
        server = import_module("waitress.server").create_server(answer, sockets=[listening], **SERVER)
        thread = threading.Thread(target=server.run, daemon=True)
        thread.start()
        for _ in range(150):
            half = open_ones.enter_context(socket.create_connection(address))
            half.sendall(b"GET / HT")
        with socket.create_connection(address, timeout=5) as asking:
            asking.sendall(b"GET / HTTP/1.0\r\n\r\n")
            assert asking.makefile("rb").read().endswith(b"hello")
        server.close()


@pytest.mark.parametrize("host", ["", "  "])
def test_no_host_is_refused(host):
    with pytest.raises(MonitorError, match="an address or name of this machine is expected"):
        _listening(host, 0)
