"""Web server of the commands with people in browsers: how a request is accepted, limited and answered.

The path of a request:

1. Its connection receives a place, or another one gives way (`admission.Visitors`).
2. It is read in parts, alternating with the other connections (`protocols`, `admission.Turns`).
3. Browsers that used the name of another machine are refused (`hosts.ForeignHosts`).
4. The gate of the server identifies the sender, receives its body up to a limit, and counts it (`gate.Gate`).
5. The handler answers, or an error says why not; each answer forbids content of other hosts (`HEADERS`).

Pages and static files (`pages`) and websockets, whose first message shows their secret, need no gate.
"""

from __future__ import annotations

import asyncio
import gc
import logging
import os
import socket
import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

from starlette.applications import Starlette
from starlette.datastructures import MutableHeaders
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect
from starlette.routing import BaseRoute
from starlette.types import ASGIApp, Lifespan, Message, Receive, Scope, Send
from uvicorn import Config, Server
from uvicorn.protocols.utils import ClientDisconnected

from dorothie_gym.lab.admission import MOST_KNOWN, MOST_STRANGERS, Turns, Visitors
from dorothie_gym.lab.hosts import ForeignHosts
from dorothie_gym.lab.protocols import Guard, GuardedHttp, GuardedSocket

logger = logging.getLogger(__name__)

ACCEPTED_AT_ONCE: Final = 32
"""Connections that are accepted in one pass of the event loop; with more, it would be late for the seats."""

BACKLOG: Final = 2048
"""Connections that the system keeps until they are accepted: a flood must not fill it, as browsers then wait 1 s."""

MAX_MESSAGE: Final = 16 * 1024
"""Largest message of a websocket [bytes]; a server that expects shorter ones refuses those with a reason."""

DESCRIPTORS: Final = 8192
"""Open files that the process requests from the system: connections, records and pictures."""

FOR_CONNECTIONS: Final = 0.75
"""Share of the open files that connections may take; the rest is for files."""

QUIET_SECONDS: Final = 60.0
"""Time in which the same kind of message is not logged again [s]."""

FREEZES: Final = 0, 50, 100, 300, 600
"""Ticks of 0.1 s after which the objects that exist are no longer searched for garbage. A flood makes Python search,
and the objects of libraries, of which a session loads some when it begins, would stop all threads for 0.3 s."""

LOGGERS: Final = "uvicorn.error", "asyncio", __name__
"""Loggers whose messages can be triggered by incoming data."""

FORWARDED: Final = "FORWARDED_ALLOW_IPS"
"""Variable of uvicorn with the addresses of proxies whose `X-Forwarded-For` is trusted; none by default."""

HEADERS: Final = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), payment=()",
    "Cache-Control": "no-cache",
}
"""Headers of every answer: nothing from other hosts, no inline scripts, no frames, no referrer."""


# --- server -----------------------------------------------------------------------------------------------------------


class WebServer(Server):
    """Server with limits for its connections.

    Args:
        config: settings of uvicorn; its protocols are of `visitors`.
        visitors: connections.
    """

    def __init__(self, config: Config, visitors: Visitors) -> None:
        super().__init__(config)
        self._visitors = visitors

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Starts to listen."""
        await super().startup(sockets)
        for listener in sockets or ():
            listener.listen(BACKLOG)  # asyncio has set it to the number of connections that it accepts at once

    async def on_tick(self, counter: int) -> bool:
        """Ends connections that have timed out; returns whether the server must stop."""
        if counter in FREEZES:
            gc.freeze()
        self._visitors.sweep()
        return await super().on_tick(counter)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stops, without waiting for strangers."""
        self._visitors.close()
        await super().shutdown(sockets)


def web_server(app: Starlette, *, host_names: Collection[str] = (), **options: Any) -> WebServer:
    """Returns a server for an application.

    Args:
        app: the application.
        host_names: further names of this machine; see `hosts.ForeignHosts`.
        options: settings of uvicorn that differ from the usual ones.
    """
    app.state.host_names = frozenset(map(str.lower, host_names))
    most = MOST_STRANGERS + MOST_KNOWN
    share = connections_allowed(most) / most
    visitors = Visitors(time.monotonic, strangers=int(share * MOST_STRANGERS), known=int(share * MOST_KNOWN))
    guard, proxies = Guard(visitors, Turns()), os.environ.get(FORWARDED, "")
    usual: dict[str, Any] = {
        "loop": "asyncio",
        "http": partial(GuardedHttp, guard),
        "ws": GuardedSocket,
        "ws_max_size": MAX_MESSAGE,
        "ws_per_message_deflate": False,
        "proxy_headers": bool(proxies),
        "forwarded_allow_ips": proxies,
        "backlog": ACCEPTED_AT_ONCE,
        "log_level": "warning",
        "access_log": False,
        "server_header": False,
        "timeout_graceful_shutdown": 2,
    }
    config = Config(Outermost(app), **(usual | options))
    logging.getLogger("uvicorn.error").addFilter(_is_not_about_waiting)
    quieten(LOGGERS)  # after the configuration has set up logging
    return WebServer(config, visitors)


def _is_not_about_waiting(record: logging.LogRecord) -> bool:
    """Returns False for uvicorn's message that requests are interrupted by a stop: `Outermost` answers them."""
    return "timeout graceful shutdown exceeded" not in str(record.msg)


class Outermost:
    """Ends requests whose client has gone, or that the stop of the server interrupts, without a traceback.

    Args:
        app: the application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles a request."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        started = False

        async def note_start(message: Message) -> None:
            nonlocal started
            started = True
            await send(message)

        try:
            await self._app(scope, receive, note_start)
        except (ClientDisconnect, ClientDisconnected):
            logger.debug("a client has gone before its request was complete")
            status = 400
        except asyncio.CancelledError:  # uvicorn cancels unfinished tasks when it stops
            logger.debug("the server stops before an answer is complete")
            status = 503
        except Exception:
            logger.exception("a request has failed")
            status = 500
        else:
            return
        if scope["type"] == "http" and not started:
            await send({"type": "http.response.start", "status": status, "headers": [(b"content-length", b"0")]})
            await send({"type": "http.response.body", "body": b""})


# --- application ------------------------------------------------------------------------------------------------------


def application(routes: Sequence[BaseRoute], lifespan: Lifespan[Starlette] | None = None) -> Starlette:
    """Returns an application whose answers have `HEADERS`, and which refuses foreign host names."""
    middleware = [Middleware(SecurityHeaders), Middleware(ForeignHosts)]
    return Starlette(routes=routes, lifespan=lifespan, middleware=middleware)


class SecurityHeaders:
    """Adds `HEADERS` to every answer.

    Args:
        app: the application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles a request."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_with_headers if scope["type"] == "http" else send)


# --- limits of the process --------------------------------------------------------------------------------------------


def connections_allowed(wanted: int) -> int:
    """Returns how many connections, up to a requested number, the raised limit of open files allows."""
    try:
        import resource
    except ImportError:  # Windows, which has no such limit
        return wanted
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != resource.RLIM_INFINITY and soft < DESCRIPTORS:
        raised = DESCRIPTORS if hard == resource.RLIM_INFINITY else min(DESCRIPTORS, hard)
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (raised, hard))
            soft = raised
        except (OSError, ValueError):
            logger.debug("the limit of open files stays at %d", soft)
    return wanted if soft == resource.RLIM_INFINITY else min(wanted, int(FOR_CONNECTIONS * soft))


def quieten(names: tuple[str, ...]) -> None:
    """Limits how often loggers repeat messages of the same kind."""
    for found in map(logging.getLogger, names):
        if not any(isinstance(each, RepeatedMessages) for each in found.filters):
            found.addFilter(RepeatedMessages())


@dataclass
class _Kind:
    """Messages of one kind: time of the last logged one, and number of those not logged since."""

    logged: float
    left_out: int = 0


@dataclass
class RepeatedMessages(logging.Filter):
    """Logs the first message of a kind, and then one in `QUIET_SECONDS` with the number of those that were left out."""

    kinds: dict[object, _Kind] = field(default_factory=dict)

    def filter(self, record: logging.LogRecord) -> bool:
        """Returns whether a message is logged."""
        kind = (record.exc_info[0] if record.exc_info else None, str(record.msg)[:30])
        now = time.monotonic()
        found = self.kinds.get(kind)
        if found is not None and now - found.logged < QUIET_SECONDS:
            found.left_out += 1
            return False
        if found is not None and found.left_out:
            record.msg = f"{record.msg} ({found.left_out} more like this since the last one)"
        if len(self.kinds) >= 100:
            self.kinds.clear()
        self.kinds[kind] = _Kind(now)
        return True
