"""Answers of the server of a study: views as JSON with a tag, and cookies."""

from __future__ import annotations

import hashlib
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from dorothie_gym.lab.gate import json_answer


def answer(view: dict[str, Any]) -> Response:
    """Answers with a view; equal views have equal tags (`ETag`)."""
    made = json_answer(view)
    made.headers["ETag"] = hashlib.sha256(made.body).hexdigest()[:24]
    return made


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
        seconds: time for which browsers keep it [s]; None: until they are closed.
        path: prefix of the paths to which it is sent.
    """
    secure = request.url.scheme == "https" or request.headers.get("origin", "").startswith("https:")
    to.set_cookie(
        cookie_name(request, name), secret, max_age=seconds, path=path, httponly=True, samesite="strict", secure=secure
    )
