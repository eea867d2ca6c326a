"""Pages and static files, kept in memory: a flood of requests for them occupies neither threads nor the disk."""

from __future__ import annotations

import hashlib
import html
import mimetypes
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Final

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import Route

SHARED: Final = Path(__file__).parent / "static"
"""Scripts and style of all pages, served below `/static`."""

TYPES: Final = {".js": "text/javascript", ".css": "text/css", ".html": "text/html", ".svg": "image/svg+xml"}
"""Media types, which differ between systems."""

_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<link rel="icon" href="/static/icon.svg" type="image/svg+xml">
{styles}
<script type="module" src="{script}"></script>
</head>
<body>
<a class="skip" href="#main">Skip to the {subject}</a>
<header id="bar"></header>
<main id="main" tabindex="-1"><p class="card">Connecting …</p></main>
<div id="notices" class="notices" role="status"></div>
<noscript><p class="card">This page needs JavaScript.</p></noscript>
</body>
</html>
"""


def files(path: str, folder: Path) -> Route:
    """Returns the route that serves the files of a folder below a path; files in folders of it are not served."""
    kept = {each.name: _kept(each.read_bytes(), _kind(each)) for each in folder.iterdir() if each.is_file()}

    async def serve(request: Request) -> Response:
        found = kept.get(str(request.path_params["name"]))
        if found is None:
            raise HTTPException(404)
        return await found(request)

    return Route(f"{path}/{{name:path}}", serve)


def page(path: str, title: str, subject: str, script: str, *styles: str) -> Route:
    """Returns the route that serves a page, whose script makes its content.

    Args:
        path: path of the page.
        title: title until the script sets another one.
        subject: target of the link at the top, for people who use the keyboard.
        script: path of the script.
        styles: paths of further style sheets.
    """
    sheets = "\n".join(f'<link rel="stylesheet" href="{sheet}">' for sheet in ("/static/style.css", *styles))
    text = _PAGE.format(title=html.escape(title), subject=html.escape(subject), script=script, styles=sheets)
    return Route(path, _kept(text.encode(), TYPES[".html"]))


def redirection(path: str, to: str) -> Route:
    """Returns the route that leads from a path to another one."""

    async def lead(request: Request) -> Response:
        return RedirectResponse(to)

    return Route(path, lead)


def _kept(content: bytes, kind: str) -> Callable[[Request], Awaitable[Response]]:
    """Returns a handler that answers with content, or that the browser has it already."""
    tag = f'"{hashlib.sha256(content).hexdigest()[:24]}"'

    async def serve(request: Request) -> Response:
        if tag in request.headers.get("if-none-match", ""):
            return Response(status_code=304, headers={"ETag": tag})
        return Response(content, media_type=kind, headers={"ETag": tag})

    return serve


def _kind(path: Path) -> str:
    return TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"
