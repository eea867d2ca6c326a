"""Web server of the annotation tool: its page, and requests of browsers with the token of their seat."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, Final, TypeAlias

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from dorothie_gym.errors import DorothieGymError
from dorothie_gym.lab.annotation.log import Action, Edit, StaleError
from dorothie_gym.lab.annotation.requests import Adopt, Mark, Step
from dorothie_gym.lab.annotation.rows import change_of, utterance_id
from dorothie_gym.lab.annotation.vocabulary import vocabulary
from dorothie_gym.lab.annotation.workplace import Seat, SeatKind, Workplace, digest_of
from dorothie_gym.lab.gate import (
    MAX_BODY,
    Caller,
    Gate,
    RequestError,
    Wording,
    bearer_token,
    gzipped_json,
    json_answer,
)
from dorothie_gym.lab.pages import SHARED, files, page, redirection
from dorothie_gym.lab.town_page import town_page
from dorothie_gym.lab.web import application
from dorothie_gym.session.recording.files import MAX_FRAME

STATIC: Final = Path(__file__).parent / "static"

BUDGET: Final = (300.0, 60.0)
"""Requests that a seat may send at once, and per second; playing a film takes some 15 a second."""

Reply: TypeAlias = Any
"""Result of a handler: a response, or a value that is sent as JSON."""

Handler: TypeAlias = Callable[[Request, Seat], Awaitable[Reply]]


WORDING: Final = Wording(
    field="reason",
    foreign="requests of other pages are refused",
    hasty="too many requests; wait a moment",
    large=f"a request has more than {MAX_BODY} bytes",
    malformed="malformed request: {}",
)


class AnnotationServer:
    """Answers requests about the sessions of a workplace.

    Args:
        workplace: sessions and seats.

    Attributes:
        gate: limits of the requests.
    """

    def __init__(self, workplace: Workplace) -> None:
        self.workplace = workplace
        self.gate = Gate(self._identify, _explain, WORDING)

    def app(self) -> Starlette:
        """Returns the application."""
        session = "/api/sessions/{number}"
        return application(
            [
                redirection("/", "/annotate"),
                page(
                    "/annotate", "dorothie_gym annotation", "session", "/annotation/main.js", "/annotation/annotate.css"
                ),
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
                files("/static", SHARED),
                files("/annotation", STATIC),
            ]
        )

    def _route(self, path: str, handler: Handler, method: str = "GET") -> Route:
        async def answer(request: Request) -> Response:
            reply = await handler(request, self._seat(request))
            return reply if isinstance(reply, Response) else json_answer(reply)

        return self.gate.route(path, answer, method)

    def _identify(self, request: Request) -> Caller:
        return Caller(key=self._seat(request).digest, budget=BUDGET, known=True)

    def _seat(self, request: Request) -> Seat:
        """Returns the seat whose secret a request has."""
        seat = self.workplace.seats.get(digest_of(bearer_token(request)))
        if seat is None:
            raise RequestError(401, "this link leads to no seat; ask for your link again")
        return seat

    # --- sessions -----------------------------------------------------------------------------------------------------

    async def _greet(self, request: Request, seat: Seat) -> Reply:
        return {**self.workplace.greeting(seat), "vocabulary": vocabulary()}

    async def _session(self, request: Request, seat: Seat) -> Reply:
        return await asyncio.to_thread(lambda: self.workplace.open(_number(request)).page.content())

    async def _town(self, request: Request, seat: Seat) -> Reply:
        page = await asyncio.to_thread(lambda: self.workplace.open(_number(request)).page)
        if page.town is None:
            raise RequestError(404, "the town of the session is not known; give --maps")
        content = await asyncio.to_thread(town_page, page.town)
        return gzipped_json(content)

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
        body = self.gate.read(request, Mark)
        return await self._edit(request, seat, body, Edit(change=change_of(body.change), label=body.label))

    async def _undo(self, request: Request, seat: Seat) -> Reply:
        return await self._edit(request, seat, self.gate.read(request, Step), Edit(action=Action.UNDO))

    async def _redo(self, request: Request, seat: Seat) -> Reply:
        return await self._edit(request, seat, self.gate.read(request, Step), Edit(action=Action.REDO))

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
        body = self.gate.read(request, Adopt)
        id, number = utterance_id(body.speaker, body.utterance), _number(request)
        adopt = self.workplace.adopt
        return await asyncio.to_thread(adopt, seat, number, body.base, id, body.annotator, again=body.again)


def _check_adjudicator(seat: Seat) -> None:
    if seat.kind is not SeatKind.ADJUDICATOR:
        raise RequestError(403, "annotators do not see the marks of others")


def _number(request: Request) -> int:
    return _whole("session", str(request.path_params["number"]))


def _frame(request: Request) -> int:
    return _whole("frame", request.query_params.get("frame", ""))


def _whole(name: str, text: str) -> int:
    """Returns a whole number; refuses other texts."""
    if not (text.isascii() and text.isdigit() and len(text) < 11 and int(text) < MAX_FRAME):
        raise RequestError(400, f"{name}: a whole number is expected")
    return int(text)


def _explain(error: BaseException) -> RequestError | None:
    match error:
        case StaleError():
            return RequestError(409, str(error))
        case DorothieGymError():
            return RequestError(400, str(error))
        case asyncio.CancelledError():  # while a picture is drawn
            return RequestError(503, "the server ends")
        case OSError():
            return RequestError(507, f"the file cannot be read or written ({error.strerror})")
    return None
