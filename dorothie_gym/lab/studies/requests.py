"""Bodies of the requests of participants' browsers: a closed set of types with checked fields."""

from __future__ import annotations

from typing import Annotated, TypeAlias, TypeVar

import msgspec
from msgspec import Meta, Struct
from starlette.requests import ClientDisconnect, Request

from dorothie_gym.lab.studies.items import MAX_TEXT
from dorothie_gym.lab.studies.stages import Stage
from dorothie_gym.ontology.roles import Role


class BodyError(Exception):
    """The body of a request is refused.

    Attributes:
        status: status of the answer.
    """

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status = status


class Body(Struct, forbid_unknown_fields=True, frozen=True):
    """Body of a request."""


_Name: TypeAlias = Annotated[str, Meta(max_length=40)]
_Parameter: TypeAlias = Annotated[str, Meta(max_length=200)]
_Value: TypeAlias = Annotated[str, Meta(max_length=2000)]
_Option: TypeAlias = Annotated[str, Meta(max_length=200)]
_Text: TypeAlias = Annotated[str, Meta(max_length=MAX_TEXT)]


class Join(Body, frozen=True):
    """Entry: parameters of the link, token of an invitation or readmission, and a random text of the tab."""

    parameters: Annotated[dict[_Parameter, _Value], Meta(max_length=200)] = {}
    invitation: Annotated[str, Meta(max_length=64)] | None = None
    visit: Annotated[str, Meta(min_length=20, max_length=64)] | None = None


class News(Body, frozen=True):
    """Request for the view as soon as it differs from the one with the tag `have`."""

    have: Annotated[str, Meta(max_length=64)] = ""


class Consent(Body, frozen=True):
    """Consent: the accepted statements; None declines."""

    agreed: Annotated[list[bool], Meta(max_length=20)] | None


class Answers(Body, frozen=True):
    """Answers to the questionnaire of a stage, by item."""

    stage: Stage
    answers: Annotated[dict[_Name, _Text | int | float | list[_Option] | None], Meta(max_length=200)]


class Proceed(Body, frozen=True):
    """Wish to end a stage; `role` is the one whose instructions were read."""

    stage: Stage
    role: Role | None = None


class Wait(Body, frozen=True):
    """Choice of a person for whom no partner was found: to continue waiting, or to finish."""

    on: bool


class Enter(Body, frozen=True):
    """Entry of the experimenter: the token of the link."""

    token: Annotated[str, Meta(max_length=64)]


class Readmit(Body, frozen=True):
    """Wish of the experimenter for a link for a person: number, or id of the recruiting platform."""

    participant: Annotated[str, Meta(min_length=1, max_length=2000)]


class Overview(Body, frozen=True):
    """Request of the experimenter for the state of the study."""


class Withdraw(Body, frozen=True):
    """Withdrawal, which the person must have confirmed."""

    sure: bool


_T = TypeVar("_T", bound=Body)


async def receive_body(request: Request, limit: int) -> None:
    """Receives the body of a request for `read_body`.

    Args:
        request: the request.
        limit: largest size [bytes]; no more is read.

    Raises:
        BodyError: it is too large, not sent as JSON, or not complete.
    """
    if request.headers.get("content-type", "").partition(";")[0].strip().lower() != "application/json":
        raise BodyError(415, "The body must be JSON.")
    content = bytearray()
    try:
        async for part in request.stream():
            content += part
            if len(content) > limit:
                raise BodyError(413, "The request is too large.")
    except ClientDisconnect:
        raise BodyError(400, "The request was not complete.") from None
    request.state.body = bytes(content)


def read_body(request: Request, kind: type[_T]) -> _T:
    """Returns the body of a request that was received.

    Args:
        request: the request.
        kind: type of the body.

    Raises:
        BodyError: it is malformed.
    """
    try:
        return msgspec.json.decode(request.state.body, type=kind)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        raise BodyError(400, "The request is malformed.") from None
