"""Hosts: names under which browsers may reach a server, and the host of the page that sends a request."""

from __future__ import annotations

import ipaddress
import socket
import threading
from typing import Final
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Receive, Scope, Send

LOCAL_NAMES: Final = frozenset({"localhost", "localhost.localdomain", "ip6-localhost"})
"""Names of the machine itself."""


class ForeignHosts:
    """Refuses browsers that used a name that does not belong to this machine ("DNS rebinding").

    The owner of a name can let it point to the server, and pages of the owner then count as pages of the server. The
    attack requires a name, so addresses are safe. It requires a page without TLS, because the owner has no certificate
    for a name of this machine, so pages with TLS are safe: they came through a proxy. Otherwise the name must be one
    of this machine, or one at which it was configured to listen (`app.state.host_names`).

    Websockets and requests that change something have an `Origin`, which scripts cannot change. Programs other than
    browsers send none, and are not refused. A page is refused only to inform the person.

    Args:
        app: the application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._names = set(LOCAL_NAMES)
        threading.Thread(target=self._find_names, daemon=True).start()  # a resolver may need seconds

    def _find_names(self) -> None:
        name = socket.gethostname().lower()
        self._names |= {name, f"{name.partition('.')[0]}.local"}
        self._names.add(socket.getfqdn().lower())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles a request."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        name = host_name(headers.get("host", ""))
        if not is_cleartext_browser(headers) or self._is_known(name, scope):
            await self._app(scope, receive, send)
            return
        shown = "".join(sign for sign in name if sign.isprintable())[:80]
        refused = PlainTextResponse(
            f"This server is not known by the name {shown!r}: open it by its address or by the name of its machine, or "
            "through a proxy with TLS.\n",
            403,
        )
        if scope["type"] == "websocket" and "websocket.http.response" not in scope.get("extensions", {}):
            await receive()
            await send({"type": "websocket.close", "code": 1008})
            return
        await refused(scope, receive, send)

    def _is_known(self, name: str, scope: Scope) -> bool:
        told: frozenset[str] = getattr(scope["app"].state, "host_names", frozenset())
        return not name or is_address(name) or name.endswith(".localhost") or name in self._names or name in told


def host_name(host: str) -> str:
    """Returns the name or address of a header `Host`, without its port, in lower case."""
    host = host.strip().lower()
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0].rstrip(".")


def is_address(name: str) -> bool:
    """Returns whether a host is given by its address."""
    try:
        ipaddress.ip_address(name.partition("%")[0])
    except ValueError:
        return False
    return True


def is_cleartext_browser(headers: Headers) -> bool:
    """Returns whether a request comes from a browser whose page was loaded without TLS, if this is known."""
    origin = headers.get("origin")
    if origin is not None:
        return not origin.lower().startswith("https://")
    opens_page = "text/html" in headers.get("accept", "")
    secure = headers.get("x-forwarded-proto", "").lower() == "https" or "sec-fetch-site" in headers
    return opens_page and not secure


def is_same_origin(connection: HTTPConnection) -> bool:
    """Returns whether a request comes from a page of this server, or from a program without an origin."""
    origin = connection.headers.get("origin")
    try:
        return origin is None or urlsplit(origin).netloc.lower() == connection.headers.get("host", "").lower()
    except ValueError:  # no address
        return False
