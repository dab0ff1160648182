"""The monitor's web application: two addresses, GET and HEAD only, read-only.

The page is accessible from this machine only, or with the token.
"""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.analysis.monitoring.page import Pages
from palpate.analysis.monitoring.watching import MonitorError, Watch

if TYPE_CHECKING:
    from flask import Flask
    from werkzeug.wrappers import Response as Answered

SHORTEST_TOKEN = 16


@dataclass(frozen=True)
class Access:
    """The access rules of a page. Without a token only this machine can reach it."""

    loopback: bool
    token: str | None

    @property
    def cookie(self) -> str:
        """The cookie's name with the port: cookies ignore ports, so two monitors of one machine need two names."""
        return f"palpate_monitor_{_derived(self.token or '', 'name')[:8]}"

    @property
    def cookie_value(self) -> str:
        """The cookie's value, derived from the token."""
        return _derived(self.token or "", "cookie")

    def host_ok(self, host: str) -> bool:
        """Return whether the Host header names this machine, which it does not after DNS rebinding."""
        name = host[: host.find("]") + 1] if host.startswith("[") else host.partition(":")[0]  # without its port
        return not self.loopback or is_loopback(name)

    def lets_in(self, token: str | None, authorization: str | None, cookies: Mapping[str, str]) -> bool:
        """Return whether the request has the token: in the address, as Authorization: Bearer, or as the cookie."""
        if self.token is None:
            return True
        scheme, _, bearer = (authorization or "").partition(" ")
        return (
            _same(token, self.token)
            or (scheme.lower() == "bearer" and _same(bearer.strip(), self.token))
            or _same(cookies.get(self.cookie), self.cookie_value)
        )


def access_for(host: str, token: str | None) -> Access:
    """Return the access rules of a page served at `host`; if others can reach it, a missing token is generated.

    Raises MonitorError if the token is too short.
    """
    if token is not None and len(token) < SHORTEST_TOKEN:
        raise MonitorError(
            f"--token: {len(token)} characters, at least {SHORTEST_TOKEN} are expected; without it one is generated"
        )
    loopback = is_loopback(host)
    return Access(loopback, token if token is not None or loopback else secrets.token_urlsafe(24))


def is_loopback(host: str) -> bool:
    """Return whether an address or name is reachable from this machine only."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def _same(given: str | None, expected: str) -> bool:
    """Compare in constant time, so that the time does not reveal how much is right."""
    return given is not None and hmac.compare_digest(given.encode(), expected.encode())


def _derived(token: str, what: str) -> str:
    return hmac.new(token.encode(), f"palpate monitor {what}".encode(), hashlib.sha256).hexdigest()


BUDGET_S = 1.0
"""Seconds that a request may read new ledgers for, so that the first page of a large lab comes at once, in part."""
HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
POLICY = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"


def make_app(watch: Watch, access: Access) -> Flask:
    """Return the application that shows `watch` to requests that `access` allows."""
    from flask import Flask

    app = Flask("palpate monitor", static_folder=None, template_folder=None)
    _guard(app, access)
    _pages(app, watch)
    return app


def _pages(app: Flask, watch: Watch) -> None:
    from flask import Response, request

    pages = Pages()

    @app.get("/")
    def page() -> Answered:
        nonce = secrets.token_urlsafe(18)
        answer = Response(pages.live(watch.look(BUDGET_S), nonce), mimetype="text/html")
        own = f"style-src 'nonce-{nonce}'; script-src 'nonce-{nonce}'; connect-src 'self'; img-src data:"
        answer.headers["Content-Security-Policy"] = f"{POLICY}; {own}"
        return answer

    @app.get("/fragment")
    def changing() -> Answered:
        body = pages.fragment(watch.look(BUDGET_S))
        answer = Response(body, mimetype="text/html")
        answer.set_etag(hashlib.sha256(body.encode()).hexdigest())
        return answer.make_conditional(request)

    @app.errorhandler(MonitorError)
    def lost(error: MonitorError) -> Answered:
        return _plain(str(error), 503)


def _guard(app: Flask, access: Access) -> None:
    """Check every request, and set the headers of every response."""
    from flask import redirect, request

    @app.before_request
    def admitted() -> Answered | None:
        if request.method not in {"GET", "HEAD"}:
            refused = _plain("This page only shows; nothing can be changed here.", 405)
            refused.headers["Allow"] = "GET, HEAD"
            return refused
        if not access.host_ok(request.host):
            return _plain(
                "This page answers only to this machine's own name: open http://127.0.0.1 with its port.", 403
            )
        if not access.lets_in(request.args.get("token"), request.headers.get("Authorization"), request.cookies):
            refused = _plain("A token is needed: open the address that palpate monitor printed when it started.", 401)
            refused.headers["WWW-Authenticate"] = "Bearer"
            return refused
        if access.token is not None and "token" in request.args:
            # The token leaves the address, where others might read it, for a cookie that no script can read.
            answer = redirect(request.path)
            answer.set_cookie(access.cookie, access.cookie_value, httponly=True, samesite="Strict", path="/")
            return answer
        return None

    @app.after_request
    def careful(answer: Answered) -> Answered:
        for name, value in HEADERS.items():
            answer.headers[name] = value
        answer.headers.setdefault("Content-Security-Policy", POLICY)
        return answer


def _plain(text: str, status: int) -> Answered:
    from html import escape

    from flask import Response

    page = f'<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>Palpate monitor</title><p>{escape(text)}</p>'
    return Response(page, status=status, mimetype="text/html")
