"""Static files of a page, kept in memory: a flood of requests for them occupies neither threads nor the disk."""

from __future__ import annotations

import hashlib
import mimetypes
from pathlib import Path
from typing import Final

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

TYPES: Final = {".js": "text/javascript", ".css": "text/css", ".html": "text/html", ".svg": "image/svg+xml"}
"""Media types, which differ between systems."""


class KeptFiles:
    """Files of a folder.

    Args:
        folder: the folder; files in folders of it are not served.
    """

    def __init__(self, folder: Path) -> None:
        self._files = {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}
        self._tags = {name: hashlib.sha256(content).hexdigest()[:24] for name, content in self._files.items()}

    def answer(self, request: Request, name: str) -> Response:
        """Answers with a file, or that the browser has it already.

        Raises:
            HTTPException: there is no such file.
        """
        content = self._files.get(name)
        if content is None:
            raise HTTPException(404)
        tag = f'"{self._tags[name]}"'
        if tag in request.headers.get("if-none-match", ""):
            return Response(status_code=304, headers={"ETag": tag})
        suffix = Path(name).suffix
        kind = TYPES.get(suffix) or mimetypes.guess_type(name)[0] or "application/octet-stream"
        return Response(content, media_type=kind, headers={"ETag": tag})

    def route(self, path: str) -> Route:
        """Returns the route that serves the files below a path."""

        async def serve(request: Request) -> Response:
            return self.answer(request, str(request.path_params["name"]))

        return Route(f"{path}/{{name:path}}", serve)

    def page(self, path: str, name: str) -> Route:
        """Returns the route that serves one file at a path."""

        async def serve(request: Request) -> Response:
            return self.answer(request, name)

        return Route(path, serve)
