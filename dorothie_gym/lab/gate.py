"""Gate of a server: who sends a request, how much and how often, and how errors are answered."""

from __future__ import annotations

import asyncio
import time
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias, TypeVar

import msgspec
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from dorothie_gym.errors import one_line
from dorothie_gym.lab.admission import TokenBucket
from dorothie_gym.lab.hosts import is_same_origin
from dorothie_gym.lab.protocols import recognise
from dorothie_gym.support.schemas import decoder

MAX_BODY: Final = 256 * 1024
"""Largest body of a request [bytes]: 50 long texts of a questionnaire take as much, marks of an utterance 1 kB."""

MOST_CALLERS: Final = 10_000
"""Maximum number of callers whose requests a gate counts."""

RETRY_SECONDS: Final = 2
"""Time after which a page that was refused for too many requests retries [s]."""

Handler: TypeAlias = Callable[[Request], Awaitable[Response]]

_T = TypeVar("_T")


class RequestError(HTTPException):
    """A request is refused. Without a gate, the reason is answered as plain text.

    Args:
        status: status of the answer.
        reason: message for the person.
        retry: time after which the same request may succeed [s]; None if it will not.
    """

    def __init__(self, status: int, reason: str, retry: int | None = None) -> None:
        super().__init__(status, reason, None if retry is None else {"Retry-After": str(retry)})


@dataclass(frozen=True, kw_only=True)
class Caller:
    """Sender of a request.

    Attributes:
        key: text by which its requests are counted.
        budget: requests that it may send at once, and per second.
        known: whether it has shown a valid secret; its connection is then kept in a flood.
    """

    key: str
    budget: tuple[float, float]
    known: bool


@dataclass(frozen=True, kw_only=True)
class Wording:
    """Texts with which a gate refuses requests.

    Attributes:
        field: field of a refusal in JSON with its reason.
        foreign: reason for requests of other pages.
        hasty: reason for too many requests.
        large: reason for a body of more than `MAX_BODY` bytes.
        malformed: reason for a malformed body; `{}` is replaced by details.
    """

    field: str
    foreign: str
    hasty: str
    large: str
    malformed: str


class Gate:
    """Way of requests to their handlers, and of errors back to the page.

    Args:
        identify: returns who sends a request; raises `RequestError` if strangers are refused.
        explain: returns the refusal with which an error of a handler is answered; None for a fault of the program.
        wording: texts of refusals.
        json_only: whether a body must be sent as JSON, which forms of other pages cannot do. A server needs this if it
            recognises people by cookies, which browsers send by themselves.

    Attributes:
        budgets: remaining requests of each caller, by key; the most recent callers are at the end.
    """

    def __init__(
        self,
        identify: Callable[[Request], Caller],
        explain: Callable[[BaseException], RequestError | None],
        wording: Wording,
        *,
        json_only: bool = False,
    ) -> None:
        self._identify, self._explain, self._wording, self._json_only = identify, explain, wording, json_only
        self.budgets: OrderedDict[str, TokenBucket] = OrderedDict()

    def route(self, path: str, handler: Handler, method: str = "POST") -> Route:
        """Returns the route on which a handler answers requests that have passed the gate."""

        async def answer(request: Request) -> Response:
            try:
                await self._admit(request)
                return await handler(request)
            except RequestError as error:
                return self._refusal(error)
            except (Exception, asyncio.CancelledError) as error:
                refused = self._explain(error)
                if refused is None:
                    raise
                return self._refusal(refused)

        return Route(path, answer, methods=[method])

    def read(self, request: Request, kind: type[_T]) -> _T:
        """Returns the body of a request; raises `RequestError` if it is malformed."""
        try:
            return decoder(kind).decode(request.state.body)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise RequestError(400, self._wording.malformed.format(one_line(error))) from None

    async def _admit(self, request: Request) -> None:
        if not is_same_origin(request):
            raise RequestError(403, self._wording.foreign)
        caller = self._identify(request)
        if caller.known:
            recognise(request)
        if request.method == "POST":
            if self._json_only and not _is_json(request):
                raise RequestError(415, "The body must be JSON.")
            request.state.body = await receive_body(request, MAX_BODY, self._wording.large)
        if not self._admits(caller):  # after the body: requests that never end would count for others at an address
            raise RequestError(429, self._wording.hasty, RETRY_SECONDS)

    def _admits(self, caller: Caller) -> bool:
        budget = self.budgets.pop(caller.key, None) or TokenBucket(*caller.budget)
        self.budgets[caller.key] = budget
        while len(self.budgets) > MOST_CALLERS:
            self.budgets.popitem(last=False)
        return budget.admits(time.monotonic())

    def _refusal(self, error: RequestError) -> Response:
        return json_answer({self._wording.field: error.detail}, error.status_code, error.headers)


async def receive_body(request: Request, limit: int, large: str) -> bytes:
    """Returns the body of a request; no more than the limit is read.

    Args:
        request: the request.
        limit: largest size [bytes].
        large: reason for refusing a larger one.

    Raises:
        RequestError: it is too large.
    """
    content = bytearray()
    async for part in request.stream():
        content += part
        if len(content) > limit:
            raise RequestError(413, large)
    return bytes(content)


def _is_json(request: Request) -> bool:
    return request.headers.get("content-type", "").partition(";")[0].strip().lower() == "application/json"


def bearer_token(request: Request) -> str:
    """Returns the secret in the header `Authorization`; an empty text if there is none."""
    scheme, _, token = request.headers.get("authorization", "").partition(" ")
    return token.strip() if scheme.lower() == "bearer" else ""


def json_answer(value: object, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Returns an answer in JSON, which browsers do not store.

    Args:
        value: content.
        status: status of the answer.
        headers: further headers.
    """
    unstored = {"Cache-Control": "no-store", **(headers or {})}
    return Response(msgspec.json.encode(value), status, unstored, media_type="application/json")


def gzipped_json(content: bytes) -> Response:
    """Returns an answer with JSON that is compressed by gzip."""
    return Response(content, media_type="application/json", headers={"Content-Encoding": "gzip"})
