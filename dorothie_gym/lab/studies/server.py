"""Web server of a study: the participants' page, its requests, and the seats of the console."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response

from dorothie_gym.lab.admission import network_of
from dorothie_gym.lab.console.server import STYLE, Console
from dorothie_gym.lab.gate import RETRY_SECONDS, Caller, Gate, Handler, RequestError, Wording
from dorothie_gym.lab.pages import files, page
from dorothie_gym.lab.studies import requests as r
from dorothie_gym.lab.studies.answers import answer, cookie_name, set_secret
from dorothie_gym.lab.studies.database import StorageError
from dorothie_gym.lab.studies.entrance import Entrance
from dorothie_gym.lab.studies.experimenter import Experimenter
from dorothie_gym.lab.studies.items import AnswerError
from dorothie_gym.lab.studies.open_rooms import OpenRooms
from dorothie_gym.lab.studies.participant_view import entrance_view, participant_view
from dorothie_gym.lab.studies.presence import Presence
from dorothie_gym.lab.studies.progress import Progress
from dorothie_gym.lab.studies.room_building import RoomBuilder
from dorothie_gym.lab.studies.stages import RefusedError
from dorothie_gym.lab.web import application

if TYPE_CHECKING:
    from dorothie_gym.lab.studies.record_types import Participant
    from dorothie_gym.lab.studies.records import StudyRecords
    from dorothie_gym.lab.studies.study import Study

logger = logging.getLogger(__name__)

_T = TypeVar("_T", bound=r.Body)

STATIC: Final = Path(__file__).parent / "static"

COOKIE: Final = "dorothie_study"
"""Cookie with the secret of a participant's browser (see `answers.cookie_name`); scripts of pages cannot read it."""

COOKIE_SECONDS: Final = 14 * 86400

NEWS_SECONDS: Final = 20.0
"""Longest time that a request for news waits [s]: below the time-outs of proxies."""

PATIENCE: Final = 2.0
"""Time after which a request for news looks again by itself, as time may have passed for its person [s]."""

TICK: Final = 0.3
"""Time between two looks at the waiting room and at the sessions [s]."""

CLEANING_PERIOD: Final = 300.0
"""Time between two deletions of people who did not decide to take part [s]."""

REQUESTS: Final = (40.0, 4.0)
"""Requests that a participant may send at once, and per second."""

ENTRIES: Final = (400.0, 10.0)
"""Requests without a participant that an address may send at once, and per second.

A laboratory or a lecture hall shares one address; an entry costs some 10 ms.
"""

WORDING: Final = Wording(
    field="error",
    foreign="This page belongs to another server.",
    hasty="Many requests are coming in. Please wait a moment.",
    large="The request is too large.",
    malformed="The request is malformed.",
)


class StudyServer:
    """Server of one study.

    Args:
        study: the study.
        sources: folder of its file, for names of files in it.
        records: records of the study.

    Attributes:
        console: rooms and seats.
        progress: participants.
        entrance: links, invitations, and readmission.
        experimenter: page of the experimenter, and the token of its link.
        gate: limits of the requests.

    Raises:
        SpeechError: people can speak, and the extra `speech` is not installed.
    """

    def __init__(self, study: Study, sources: Path, records: StudyRecords) -> None:
        self.console = Console(suspends=True, speech=study.session.speech)
        self._presence = Presence()
        self._records = records
        self.rooms = OpenRooms(
            study, RoomBuilder(study, sources, records.folder), records, self.console, self._presence.tell
        )
        self.progress = Progress(study, records, self.rooms, self._presence)
        self.entrance = Entrance(study, records)
        self.experimenter = Experimenter(self.progress, self.entrance)
        self.gate = Gate(self._identify, _explain, WORDING, json_only=True)
        self._withdrawing: set[str] = set()

    def app(self) -> Starlette:
        """Returns the application, which plays the study while it runs."""

        @contextlib.asynccontextmanager
        async def lifespan(app: Starlette) -> AsyncIterator[None]:
            async with self.console.running():
                self.progress.finish_erasures()
                self.progress.reopen()
                task = asyncio.create_task(self._supervise())
                try:
                    yield
                finally:
                    task.cancel()
                    await asyncio.gather(task, return_exceptions=True)
                    self._presence.tell()

        actions: dict[str, Handler] = {
            "join": self._join,
            "news": self._news,
            "consent": self._consent,
            "answers": self._answers,
            "proceed": self._proceed,
            "wait": self._wait,
            "withdraw": self._withdraw,
        }
        routes = [
            page("/", "Study", "study", "/studies/study.js", STYLE, "/studies/study.css"),
            *(self.gate.route(f"/study/{name}", handler) for name, handler in actions.items()),
            *self.experimenter.routes(self.gate),
            files("/studies", STATIC),
            *self.console.routes(),
        ]
        return application(routes, lifespan)

    async def _supervise(self) -> None:
        """Pairs people, records the ends of sessions, and deletes people who did not decide to take part."""
        cleaned = 0.0
        while True:
            await asyncio.sleep(TICK)
            try:
                if time.monotonic() - cleaned > CLEANING_PERIOD:
                    self.progress.forget_undecided()
                    self.progress.retry_erasures()
                    cleaned = time.monotonic()
                changed = self.progress.note_ends()
                for place in self.rooms.mind(time.monotonic()):
                    self.progress.dissolve(place)
                    changed = True
                changed = self.progress.waiting.pair() or changed
                changed = self.progress.waiting.mend_roles() or changed
            except StorageError as error:
                logger.error("the study could not be stored; it tries again: %s", error)
                await asyncio.sleep(5.0)
            except Exception:
                logger.exception("the study could not go on; it tries again")
                await asyncio.sleep(5.0)
            else:
                if changed:
                    self._presence.tell()

    # --- requests ---------------------------------------------------------------------------------------------------

    def _identify(self, request: Request) -> Caller:
        person = self._person(request)
        if person is not None:
            return Caller(key=person.id, budget=REQUESTS, known=True)
        if self.experimenter.is_known(request):
            return Caller(key="experimenter", budget=REQUESTS, known=True)
        return Caller(key=network_of(request.client.host if request.client else None), budget=ENTRIES, known=False)

    def _not_signed_in(self) -> RequestError:
        return RequestError(401, f"You do not take part here any more. Contact: {self.progress.study.contact}")

    def _person(self, request: Request) -> Participant | None:
        secret = request.cookies.get(cookie_name(request, COOKIE))
        name = None if not secret else self._records.find_secret(secret)
        return None if name is None or name in self._withdrawing else self._records.participant(name)

    def _read(self, request: Request, kind: type[_T]) -> tuple[Participant, _T]:
        """Returns the participant and the body of a request."""
        body = self.gate.read(request, kind)
        person = self._person(request)  # again, as the body may have arrived late
        if person is None:
            raise self._not_signed_in()
        self._presence.see(person.id)
        return person, body

    def _view(self, person: Participant) -> Response:
        """Answers with the current view of a participant."""
        self._presence.tell()
        found = self._records.participant(person.id)
        return answer(entrance_view(self.progress) if found is None else participant_view(self.progress, found))

    async def _join(self, request: Request) -> Response:
        body = self.gate.read(request, r.Join)
        person, given = self._person(request), (body.parameters, body.invitation)
        if person is not None and not self.entrance.is_other_person(person.id, *given):
            return self._view(person)
        name, secret = self.entrance.join(*given, body.visit)
        joined = answer(participant_view(self.progress, self._known(name)))
        set_secret(joined, request, COOKIE, secret, COOKIE_SECONDS)
        return joined

    def _known(self, name: str) -> Participant:
        found = self._records.participant(name)
        if found is None:
            raise self._not_signed_in()
        return found

    async def _news(self, request: Request) -> Response:
        """Answers with the view of a participant as soon as it differs from the one that the browser has."""
        person, body = self._read(request, r.News)
        if time.time() - person.seen > 60.0:
            self._records.see(person.id)
        end = time.monotonic() + NEWS_SECONDS
        async with self._presence.asking(person.id):
            while True:
                news = answer(participant_view(self.progress, self._known(person.id)))
                left = end - time.monotonic()
                if news.headers["etag"] != body.have or left <= 0.0:
                    return news
                try:
                    await self._presence.wait_for_news(min(left, PATIENCE))
                except asyncio.CancelledError:
                    return news  # the server stops
                if await request.is_disconnected():
                    return news

    async def _consent(self, request: Request) -> Response:
        person, body = self._read(request, r.Consent)
        if body.agreed is None:
            self.progress.decline(person)
            return _farewell(request, self.progress.study.texts.declined, again=True)
        self.progress.consent(person, body.agreed)
        return self._view(person)

    async def _answers(self, request: Request) -> Response:
        person, body = self._read(request, r.Answers)
        self.progress.answer(person, body.stage, body.answers)
        return self._view(person)

    async def _proceed(self, request: Request) -> Response:
        person, body = self._read(request, r.Proceed)
        if body.role is not None and body.role is not person.role:
            raise RefusedError("Your role has just changed. Please read the new instructions.")
        self.progress.proceed(person, body.stage)
        return self._view(person)

    async def _wait(self, request: Request) -> Response:
        person, body = self._read(request, r.Wait)
        if body.on:
            self.progress.waiting.wait_on(person)
        else:
            self.progress.waiting.give_up(person)
        return self._view(person)

    async def _withdraw(self, request: Request) -> Response:
        person, body = self._read(request, r.Withdraw)
        if not body.sure:
            raise RefusedError("Please confirm that you want to withdraw.")
        self._withdrawing.add(person.id)
        try:
            clean = await asyncio.shield(self.progress.withdraw(person))  # also if the browser has disconnected since
        finally:
            self._withdrawing.discard(person.id)
        self._presence.tell()
        study = self.progress.study
        return _farewell(request, study.texts.withdrawn if clean else _NOT_YET.format(study.contact))


_NOT_YET: Final = (
    "You have withdrawn. A part of what was recorded about you could not be deleted at once; the server tries again "
    "until it is. Contact: {}"
)


def _explain(error: BaseException) -> RequestError | None:
    if isinstance(error, StorageError):
        logger.warning("a request of the page could not be stored: %s", error)
        return RequestError(503, "This could not be stored. Please wait a moment.", RETRY_SECONDS)
    return RequestError(409, str(error)) if isinstance(error, RefusedError | AnswerError) else None


def _farewell(request: Request, text: str, *, again: bool = False) -> Response:
    """Answers a person whose data have been deleted; `again`: whether the page offers to start again."""
    gone = answer({"gone": text, "again": again})
    gone.delete_cookie(cookie_name(request, COOKIE), httponly=True, samesite="strict")
    return gone
