"""Open rooms of a running study: which person sits where, and how the sessions end."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from dorothie_gym.lab.console.config import AfterAbsence
from dorothie_gym.lab.console.room import Room
from dorothie_gym.lab.console.seat import RoomState
from dorothie_gym.lab.studies.erasure import remove_attempts
from dorothie_gym.lab.studies.record_types import SessionRow
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.recording.events import EndReason
from dorothie_gym.session.recording.files import SessionState

if TYPE_CHECKING:
    from dorothie_gym.lab.console.server import Console
    from dorothie_gym.lab.studies.records import StudyRecords
    from dorothie_gym.lab.studies.room_building import RoomBuilder
    from dorothie_gym.lab.studies.study import Study

logger = logging.getLogger(__name__)

AT_ONCE: Final = 2
"""Rooms that are built at the same time."""

IDLE_SECONDS: Final = 120.0
"""Time after which a tutorial or a finished session is closed if it has no people [s]; a tutorial then begins again."""

LEAST_PATIENCE: Final = 15.0
"""Shortest time for the people of a new session to sit down [s]: pages have to load."""

STOP_SECONDS: Final = 10.0
"""Longest time for a session to end on request; after that, its room is closed in any state [s]."""


@dataclass(eq=False)
class OpenRoom:
    """Room that is open or being built.

    Attributes:
        people: ids of the participants, by role.
        session: the session; None for a tutorial.
        resumes: whether it resumes a session of a stopped server.
        opened: clock at which it was opened [s].
        attended: clock at which people were in it last [s].
        room: the room; None while it is being built.
        ready: set when it is built.
    """

    people: Mapping[Role, str]
    session: SessionRow | None
    resumes: bool = False
    opened: float = field(default_factory=time.monotonic)
    attended: float = field(default_factory=time.monotonic)
    room: Room | None = None
    ready: asyncio.Event = field(default_factory=asyncio.Event)

    @property
    def is_over(self) -> bool:
        """Whether the session has ended."""
        return self.room is not None and self.room.state is RoomState.OVER


class OpenRooms:
    """Rooms of a study that are open.

    All methods are for the event loop.

    Args:
        study: the study.
        builder: builder of rooms.
        records: records of the study.
        console: server of the rooms.
        changed: called when participants must be notified of a change.
    """

    def __init__(
        self, study: Study, builder: RoomBuilder, records: StudyRecords, console: Console, changed: Callable[[], None]
    ) -> None:
        self._study, self._builder, self._records, self._console = study, builder, records, console
        self._changed = changed
        self._rooms: list[OpenRoom] = []
        self._builds = asyncio.Semaphore(AT_ONCE)
        self._tasks: set[asyncio.Task[None]] = set()

    def all(self) -> list[OpenRoom]:
        """Returns all rooms, the oldest first."""
        return list(self._rooms)

    # --- opening ----------------------------------------------------------------------------------------------------

    def of_session(self, session: str) -> OpenRoom | None:
        """Returns the room of a session; None if it is not open."""
        return next((each for each in self._rooms if each.session is not None and each.session.id == session), None)

    def tutorial_of(self, name: str) -> OpenRoom | None:
        """Returns the tutorial of a participant; None if it is not open."""
        found = (each for each in self._rooms if each.session is None and name in each.people.values())
        return next(found, None)

    def open_tutorial(self, name: str, role: Role) -> OpenRoom:
        """Opens the tutorial of a participant, or returns the open one."""
        return self.tutorial_of(name) or self._open(OpenRoom(people={role: name}, session=None))

    def open_session(self, row: SessionRow, people: Mapping[Role, str]) -> OpenRoom:
        """Opens the room of a session; resumes one that a stopped server interrupted."""
        found = self.of_session(row.id)
        if found is not None:
            return found
        state = self._builder.state(row)
        resumes = state is SessionState.PARTIAL
        if state is SessionState.ABSENT:
            remove_attempts(self._records, row.id)  # a server that died before the header was written
            self._records.set_folder(row.id, row.id)  # before the record begins, so that a restart finds it
        return self._open(OpenRoom(people=dict(people), session=row, resumes=resumes))

    def summary_left_behind(self, row: SessionRow) -> Mapping[str, object] | None:
        """Returns the outcome of a session whose record is complete; None if it is not."""
        return self._builder.summary(row)

    def _open(self, place: OpenRoom) -> OpenRoom:
        self._rooms.append(place)
        task = asyncio.create_task(self._build(place))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return place

    async def _build(self, place: OpenRoom) -> None:
        row = place.session
        try:
            async with self._builds:
                if row is None:
                    (role,) = place.people
                    room = await asyncio.to_thread(self._builder.tutorial, role)
                else:
                    room = await asyncio.to_thread(self._builder.session, row, place.people)
        except Exception:  # such as a full disk; the others continue
            logger.exception("%s cannot be opened", "a tutorial" if row is None else f"session {row.id}")
            self._rooms.remove(place)
            if row is not None:
                self._records.finish_session(row.id, EndReason.TECHNICAL.value, success=None, seconds=None)
                self._records.set_group_state(row.group, "broken")
        else:
            place.room, place.opened, place.attended = room, time.monotonic(), time.monotonic()
            self._console.open(room)
            if row is not None and place.resumes and room.record is not None:
                self._records.set_folder(row.id, room.record.folder.name)
                remove_attempts(self._records, row.id, keep=room.record.folder.name)
        finally:  # also if none of this could be noted
            place.ready.set()
            self._changed()

    def token(self, place: OpenRoom, name: str) -> str | None:
        """Returns the token of a participant's seat; None while the room is being built."""
        if place.room is None:
            return None
        role = next(role for role, person in place.people.items() if person == name)
        return place.room.seats[role.value].token

    # --- progress ---------------------------------------------------------------------------------------------------

    def finished(self) -> list[OpenRoom]:
        """Returns the sessions that have ended."""
        return [each for each in self._rooms if each.is_over and each.session is not None]

    def mind(self, now: float) -> list[OpenRoom]:
        """Closes idle rooms and applies the rules for people who do not come.

        Args:
            now: monotonic clock [s].

        Returns:
            New sessions whose people did not all sit down.
        """
        missed = []
        for place in [each for each in self._rooms if each.room is not None]:
            assert place.room is not None
            if any(seat.present for seat in place.room.seats.values() if seat.role is not None):
                place.attended = now
            if place.session is None or place.is_over:
                if now - place.attended > IDLE_SECONDS:
                    self.close(place)
            elif place.room.state is RoomState.WAITING and now - place.opened > self._patience:
                if not place.resumes:
                    missed.append(place)
                elif place.attended == now:
                    self._go_on_without(place.room)
        return missed

    @property
    def _patience(self) -> float:
        return max(LEAST_PATIENCE, self._study.absence.seconds)

    def _go_on_without(self, room: Room) -> None:
        """Applies the rules for people who leave to people who do not return after a restart."""
        if self._study.absence.then is AfterAbsence.END:
            room.end(EndReason.LEFT)
        elif self._study.absence.then is AfterAbsence.SCRIPT:
            room.start()

    def close(self, place: OpenRoom) -> None:
        """Closes a room; does nothing if it is closed."""
        if place not in self._rooms:
            return
        self._rooms.remove(place)
        if place.room is not None:
            self._console.close(place.room)

    async def stop(self, place: OpenRoom, reason: EndReason) -> None:
        """Ends the session of a room if it is in progress, waits until its record is closed, and closes the room."""
        await place.ready.wait()
        if place.room is None:
            return  # it could not be built
        end = time.monotonic() + STOP_SECONDS
        while place in self._rooms and not place.is_over and time.monotonic() < end:
            place.room.end(reason)
            await asyncio.sleep(0.05)
        self.close(place)
