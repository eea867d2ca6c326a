"""Answers of the server of a study: views as JSON with a tag, refusals, and cookies."""

from __future__ import annotations

import hashlib
from typing import Any

import msgspec
from starlette.requests import Request
from starlette.responses import Response


def answer(view: dict[str, Any]) -> Response:
    """Answers with a view, which is not stored; equal views have equal tags (`ETag`)."""
    content = msgspec.json.encode(view)
    return Response(
        content,
        media_type="application/json",
        headers={"Cache-Control": "no-store", "ETag": hashlib.sha256(content).hexdigest()[:24]},
    )


def refusal(status: int, reason: str, retry: int | None = None) -> Response:
    """Answers that a request is refused.

    Args:
        status: status of the answer.
        reason: reason, which the page shows.
        retry: time after which the same request may succeed [s]; None if it will not.
    """
    refused = answer({"error": reason})
    refused.status_code = status
    if retry is not None:
        refused.headers["Retry-After"] = str(retry)
    return refused


def cookie_name(request: Request, name: str) -> str:
    """Returns the name of a cookie with the port that the browser has used, as browsers share cookies among ports.

    Args:
        request: the request; a host without a port, such as that of a proxy, has no other server.
        name: name without the port.
    """
    port = request.headers.get("host", "").rpartition(":")[2]
    return f"{name}_{port}" if port.isascii() and port.isdigit() and len(port) < 6 else name


def set_secret(to: Response, request: Request, name: str, secret: str, seconds: int | None, path: str = "/") -> None:
    """Adds a cookie with a secret that scripts of pages cannot read and pages of other hosts do not send.

    Args:
        to: the answer.
        request: the request, whose page says whether the cookie needs TLS.
        name: name of the cookie, without the port.
        secret: its value.
        seconds: how long browsers keep it [s]; None: until they are closed.
        path: beginning of the paths to which it is sent.
    """
    secure = request.url.scheme == "https" or request.headers.get("origin", "").startswith("https:")
    to.set_cookie(
        cookie_name(request, name), secret, max_age=seconds, path=path, httponly=True, samesite="strict", secure=secure
    )
