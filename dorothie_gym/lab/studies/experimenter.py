"""Experimenter of a running study: entrance by a link that works once, people who wait, and rooms to look after."""

from __future__ import annotations

import secrets
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from dorothie_gym.lab.console.seat import EXPERIMENTER, RoomState
from dorothie_gym.lab.console.server import STYLE
from dorothie_gym.lab.gate import Gate, RequestError
from dorothie_gym.lab.pages import page
from dorothie_gym.lab.studies import requests as r
from dorothie_gym.lab.studies.answers import answer, cookie_name, set_secret
from dorothie_gym.lab.studies.records import digest
from dorothie_gym.lab.studies.stages import RefusedError

if TYPE_CHECKING:
    from dorothie_gym.lab.studies.entrance import Entrance
    from dorothie_gym.lab.studies.open_rooms import OpenRoom
    from dorothie_gym.lab.studies.progress import Progress

COOKIE: Final = "dorothie_experimenter"
"""Cookie with the secret of the experimenter's browser; scripts of pages cannot read it."""

PATH: Final = "/study/experimenter"
"""Beginning of the paths of the experimenter's requests, to which alone the cookie is sent."""


class Experimenter:
    """Page of the experimenter of a study.

    Args:
        progress: participants of the study.
        entrance: links with which people continue.

    Attributes:
        token: token of the link, which admits one browser; the next server has another one.
    """

    def __init__(self, progress: Progress, entrance: Entrance) -> None:
        self.token = secrets.token_urlsafe(16)
        self._progress, self._entrance = progress, entrance
        self._unused = True
        self._browser: bytes | None = None

    def routes(self, gate: Gate) -> list[Route]:
        """Returns the routes of the page and its requests, which pass a gate."""
        return [
            page("/experimenter", "Experimenter", "study", "/studies/experimenter.js", STYLE, "/studies/study.css"),
            gate.route(f"{PATH}/enter", partial(self._enter, gate)),
            gate.route(f"{PATH}/overview", partial(self._overview, gate)),
            gate.route(f"{PATH}/readmit", partial(self._readmit, gate)),
        ]

    def is_known(self, request: Request) -> bool:
        """Returns whether a request comes from the browser that the link has admitted."""
        given = request.cookies.get(cookie_name(request, COOKIE))
        return bool(given) and self._browser is not None and secrets.compare_digest(digest(str(given)), self._browser)

    def _check(self, request: Request) -> None:
        if not self.is_known(request):
            raise RequestError(401, "Open the link of the experimenter.")

    async def _enter(self, gate: Gate, request: Request) -> Response:
        body = gate.read(request, r.Enter)
        if self.is_known(request):
            return answer(self.overview())
        if not self._unused or not secrets.compare_digest(digest(body.token), digest(self.token)):
            raise RefusedError(
                "This link is not valid, or it has been used. Stop the server and start it again: it prints a new one, "
                "and the study goes on."
            )
        secret = secrets.token_urlsafe(32)
        self._unused, self._browser = False, digest(secret)
        entered = answer(self.overview())
        set_secret(entered, request, COOKIE, secret, None, PATH)
        return entered

    async def _overview(self, gate: Gate, request: Request) -> Response:
        gate.read(request, r.Overview)
        self._check(request)
        return answer(self.overview())

    async def _readmit(self, gate: Gate, request: Request) -> Response:
        """Answers with the token of a link with which a person can continue in another browser once."""
        body = gate.read(request, r.Readmit)
        self._check(request)
        token = self._entrance.readmit(body.participant.strip())
        if token is None:
            raise RefusedError("Nobody with this number, or this id of the recruiting platform, takes part.")
        return answer({"token": token})

    # --- content ------------------------------------------------------------------------------------------------------

    def overview(self) -> dict[str, Any]:
        """Returns people who wait, people by stage, and open rooms with the token of the experimenter's seat there."""
        progress, present = self._progress, set(self._progress.present())
        rooms = [self._row(place) for place in progress.rooms.all() if place.room is not None]
        return {
            "title": progress.study.title,
            "stages": {stage.value: number for stage, number in progress.records.stage_counts().items()},
            "waiting": [
                {"id": person.id, "role": person.role and person.role.value, "seconds": round(seconds)}
                for person, seconds in progress.waiting.present()
            ],
            "people": [
                {"id": person.id, "stage": person.stage.value, "present": person.id in present}
                for person in progress.records.participants()
            ],
            "rooms": sorted(rooms, key=lambda row: (row["session"] is None, row["session"] or "")),
        }

    @staticmethod
    def _row(place: OpenRoom) -> dict[str, Any]:
        room, row = place.room, place.session
        assert room is not None
        return {
            "session": None if row is None else row.id,
            "condition": None if row is None else row.condition,
            "state": room.state.value,
            "seconds": round(room.engine.session.world.time),
            "people": [
                {"id": name, "role": role.value, "present": room.seats[role.value].present}
                for role, name in place.people.items()
            ],
            "token": None if room.state is RoomState.OVER else room.seats[EXPERIMENTER].token,
        }
