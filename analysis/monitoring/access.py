"""Who may see the monitor's page: this machine alone, or whoever has the token."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import secrets
from collections.abc import Mapping
from dataclasses import dataclass

from palpate.analysis.monitoring.watching import MonitorError

SHORTEST_TOKEN = 16


@dataclass(frozen=True)
class Access:
    """What a request must bring. Without a token only this machine can reach the page at all."""

    loopback: bool
    token: str | None

    @property
    def cookie(self) -> str:
        """The cookie's name: cookies know no ports, so two monitors of one machine need two names."""
        return f"palpate_monitor_{_derived(self.token or '', 'name')[:8]}"

    @property
    def cookie_value(self) -> str:
        """What the cookie holds in the token's stead."""
        return _derived(self.token or "", "cookie")

    def host_ok(self, host: str) -> bool:
        """Whether the Host header names this machine, as it does unless a web page was rebound to our address."""
        return not self.loopback or is_loopback(_without_port(host))

    def lets_in(self, token: str | None, authorization: str | None, cookies: Mapping[str, str]) -> bool:
        """Whether the token came: in the address, as Authorization: Bearer, or as our cookie."""
        if self.token is None:
            return True
        scheme, _, bearer = (authorization or "").partition(" ")
        return (
            _same(token, self.token)
            or (scheme.lower() == "bearer" and _same(bearer.strip(), self.token))
            or _same(cookies.get(self.cookie), self.cookie_value)
        )


def access_for(host: str, token: str | None) -> Access:
    """Who may see a page served at `host`: a token is made where others could reach it and none was given.

    Raises MonitorError on a token that is too short.
    """
    if token is not None and len(token) < SHORTEST_TOKEN:
        raise MonitorError(
            f"--token: {len(token)} characters, at least {SHORTEST_TOKEN} are expected; leave it out and one is made"
        )
    loopback = is_loopback(host)
    return Access(loopback, token if token is not None or loopback else secrets.token_urlsafe(24))


def is_loopback(host: str) -> bool:
    """Whether an address or name means this machine alone."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def _without_port(host: str) -> str:
    if host.startswith("["):
        return host[: host.find("]") + 1]
    return host.partition(":")[0]


def _same(given: str | None, expected: str) -> bool:
    """Compared in a time that does not tell how much of it is right."""
    return given is not None and hmac.compare_digest(given.encode(), expected.encode())


def _derived(token: str, what: str) -> str:
    return hmac.new(token.encode(), f"palpate monitor {what}".encode(), hashlib.sha256).hexdigest()
