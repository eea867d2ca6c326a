"""Web server of the annotation tool: its page, and requests of browsers with the token of their seat."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, Final, TypeAlias

import msgspec
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import Route

from dorothie_gym.errors import DorothieGymError
from dorothie_gym.lab.annotation.log import Action, Edit, StaleError
from dorothie_gym.lab.annotation.requests import MAX_BODY, Adopt, Mark, RequestError, Step, decode
from dorothie_gym.lab.annotation.rows import change_of, utterance_id
from dorothie_gym.lab.annotation.vocabulary import vocabulary
from dorothie_gym.lab.annotation.workplace import Seat, SeatKind, Workplace, digest_of
from dorothie_gym.lab.console.kept_files import KeptFiles
from dorothie_gym.lab.console.protocols import recognise
from dorothie_gym.lab.console.server import STATIC as CONSOLE_STATIC
from dorothie_gym.lab.console.server import is_same_origin, protection
from dorothie_gym.lab.console.town_page import town_page
from dorothie_gym.session.recording.file_names import MAX_FRAME

STATIC: Final = Path(__file__).parent / "static"

BURST, RATE = 300.0, 60.0
"""Requests that a seat may send at once, and per second; playing a film takes some 15 a second."""

Reply: TypeAlias = Any
"""Result of a handler: a response, or a value that is sent as JSON."""

Handler: TypeAlias = Callable[[Request, Seat], Awaitable[Reply]]


class RefusedError(DorothieGymError):
    """A request is refused.

    Args:
        status: status of the answer.
        reason: message for the person.
    """

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(status, reason)
        self.status, self.reason = status, reason

    def message(self) -> str:
        """Returns the reason."""
        return self.reason


class AnnotationServer:
    """Answers requests about the sessions of a workplace.

    Args:
        workplace: sessions and seats.
    """

    def __init__(self, workplace: Workplace) -> None:
        self.workplace = workplace
        self._budgets: dict[str, tuple[float, float]] = {}

    def app(self) -> Starlette:
        """Returns the application."""
        files = KeptFiles(STATIC)

        async def root(request: Request) -> Response:
            return RedirectResponse("/annotate")

        session = "/api/sessions/{number}"
        routes = [
            Route("/", root),
            files.page("/annotate", "annotate.html"),
            self._route("/api/seat", self._greet),
            self._route(session, self._session),
            self._route(f"{session}/town", self._town),
            self._route(f"{session}/bodies", self._bodies),
            self._route(f"{session}/picture", self._picture),
            self._route(f"{session}/audio/{{name}}", self._audio),
            self._route(f"{session}/marks", self._marks),
            self._route(f"{session}/mark", self._mark, "POST"),
            self._route(f"{session}/undo", self._undo, "POST"),
            self._route(f"{session}/redo", self._redo, "POST"),
            self._route(f"{session}/versions", self._versions),
            self._route(f"{session}/history", self._history),
            self._route(f"{session}/adopt", self._adopt, "POST"),
            KeptFiles(CONSOLE_STATIC).route("/static"),
            files.route("/annotation"),
        ]
        return Starlette(routes=routes, middleware=protection())

    def _route(self, path: str, handler: Handler, method: str = "GET") -> Route:
        async def answer(request: Request) -> Response:
            try:
                reply = await handler(request, self._seat(request))
            except RefusedError as error:
                return _json({"reason": str(error)}, error.status)
            except StaleError as error:
                return _json({"reason": str(error)}, 409)
            except DorothieGymError as error:
                return _json({"reason": str(error)}, 400)
            except ClientDisconnect:
                return Response(status_code=400)
            except asyncio.CancelledError:  # the server ends while a picture is drawn
                return _json({"reason": "the server ends"}, 503)
            except OSError as error:
                return _json({"reason": f"the file cannot be read or written ({error.strerror})"}, 507)
            return reply if isinstance(reply, Response) else _json(reply)

        return Route(path, answer, methods=[method])

    # --- who asks -----------------------------------------------------------------------------------------------------

    def _seat(self, request: Request) -> Seat:
        """Returns the seat of a request; refuses wrong tokens, foreign pages and too many requests."""
        if not is_same_origin(request):
            raise RefusedError(403, "requests of other pages are refused")
        scheme, _, token = request.headers.get("authorization", "").partition(" ")
        seat = self.workplace.seats.get(digest_of(token.strip())) if scheme.lower() == "bearer" else None
        if seat is None:
            raise RefusedError(401, "this link leads to no seat; ask for your link again")
        recognise(request)
        budget, seen = self._budgets.get(seat.digest, (BURST, time.monotonic()))
        now = time.monotonic()
        budget = min(BURST, budget + RATE * (now - seen))
        self._budgets[seat.digest] = max(budget - 1.0, 0.0), now
        if budget < 1.0:
            raise RefusedError(429, "too many requests; wait a moment")
        return seat

    # --- sessions -----------------------------------------------------------------------------------------------------

    async def _greet(self, request: Request, seat: Seat) -> Reply:
        return {**self.workplace.greeting(seat), "vocabulary": vocabulary()}

    async def _session(self, request: Request, seat: Seat) -> Reply:
        return await asyncio.to_thread(lambda: self.workplace.open(_number(request)).page.content())

    async def _town(self, request: Request, seat: Seat) -> Reply:
        page = await asyncio.to_thread(lambda: self.workplace.open(_number(request)).page)
        if page.town is None:
            raise RefusedError(404, "the town of the session is not known; give --maps")
        content = await asyncio.to_thread(town_page, page.town)
        return Response(content, media_type="application/json", headers={"Content-Encoding": "gzip"})

    async def _bodies(self, request: Request, seat: Seat) -> Reply:
        frame = _frame(request)
        return await asyncio.to_thread(lambda: self.workplace.open(_number(request)).page.bodies(frame))

    async def _picture(self, request: Request, seat: Seat) -> Reply:
        frame = _frame(request)
        content = await asyncio.to_thread(lambda: self.workplace.open(_number(request)).page.picture(frame))
        return Response(content, media_type="image/jpeg")

    async def _audio(self, request: Request, seat: Seat) -> Reply:
        name = str(request.path_params["name"])
        content = await asyncio.to_thread(lambda: self.workplace.open(_number(request)).page.audio(name))
        return Response(content, media_type="audio/wav" if name.endswith(".wav") else "audio/flac")

    # --- marks --------------------------------------------------------------------------------------------------------

    async def _marks(self, request: Request, seat: Seat) -> Reply:
        return await asyncio.to_thread(self.workplace.marks, seat, _number(request))

    async def _mark(self, request: Request, seat: Seat) -> Reply:
        body = decode(await _body(request), Mark)
        return await self._edit(request, seat, body, Edit(change=change_of(body.change), label=body.label))

    async def _undo(self, request: Request, seat: Seat) -> Reply:
        return await self._edit(request, seat, decode(await _body(request), Step), Edit(action=Action.UNDO))

    async def _redo(self, request: Request, seat: Seat) -> Reply:
        return await self._edit(request, seat, decode(await _body(request), Step), Edit(action=Action.REDO))

    async def _edit(self, request: Request, seat: Seat, body: Step, edit: Edit) -> Reply:
        number = _number(request)
        return await asyncio.to_thread(self.workplace.edit, seat, number, body.base, edit, again=body.again)

    # --- adjudication -------------------------------------------------------------------------------------------------

    async def _versions(self, request: Request, seat: Seat) -> Reply:
        _check_adjudicator(seat)
        return await asyncio.to_thread(self.workplace.versions, _number(request))

    async def _history(self, request: Request, seat: Seat) -> Reply:
        _check_adjudicator(seat)
        return await asyncio.to_thread(self.workplace.history, _number(request), seat)

    async def _adopt(self, request: Request, seat: Seat) -> Reply:
        _check_adjudicator(seat)
        body = decode(await _body(request), Adopt)
        id, number = utterance_id(body.speaker, body.utterance), _number(request)
        adopt = self.workplace.adopt
        return await asyncio.to_thread(adopt, seat, number, body.base, id, body.annotator, again=body.again)


def _check_adjudicator(seat: Seat) -> None:
    if seat.kind is not SeatKind.ADJUDICATOR:
        raise RefusedError(403, "annotators do not see the marks of others")


def _number(request: Request) -> int:
    return _whole("session", str(request.path_params["number"]))


def _frame(request: Request) -> int:
    return _whole("frame", request.query_params.get("frame", ""))


def _whole(name: str, text: str) -> int:
    """Returns a whole number; raises `RequestError` for other texts."""
    if not (text.isascii() and text.isdigit() and len(text) < 11 and int(text) < MAX_FRAME):
        raise RequestError(f"{name}: a whole number is expected")
    return int(text)


async def _body(request: Request) -> bytes:
    """Returns the body of a request; raises `RefusedError` if it is too large."""
    content = b""
    async for chunk in request.stream():
        content += chunk
        if len(content) > MAX_BODY:
            raise RefusedError(413, f"a request has more than {MAX_BODY} bytes")
    return content


def _json(value: object, status: int = 200) -> Response:
    return Response(msgspec.json.encode(value), status, media_type="application/json")
