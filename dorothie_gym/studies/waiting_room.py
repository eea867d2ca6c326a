"""Waiting room: pairing of people who are present, later sessions of a group, and people who wait in vain."""

from __future__ import annotations

import logging
import time

from dorothie_gym.studies.assignment import Assigner, match
from dorothie_gym.studies.open_rooms import OpenRooms
from dorothie_gym.studies.presence import Presence
from dorothie_gym.studies.record_types import Group, Participant
from dorothie_gym.studies.records import StudyRecords
from dorothie_gym.studies.stages import Outcome, RefusedError, Stage, check_stage, next_stage
from dorothie_gym.studies.study import Study

logger = logging.getLogger(__name__)


class WaitingRoom:
    """People who wait for a session.

    Args:
        study: the study.
        records: records of the study.
        rooms: open rooms.
        presence: people whose browsers are connected.
        assigner: places of groups.
    """

    def __init__(
        self, study: Study, records: StudyRecords, rooms: OpenRooms, presence: Presence, assigner: Assigner
    ) -> None:
        self._study, self._records, self._rooms, self._presence = study, records, rooms, presence
        self._assigner = assigner
        self._waiting_since: dict[str, float] = {}

    def present(self) -> list[tuple[Participant, float]]:
        """Returns the people who wait and are present, and since when [s]; the longest waiting first."""
        now = time.monotonic()
        return [(person, now - self._waiting_since[person.id]) for person in self._waiting()]

    def forget(self, name: str) -> None:
        """Forgets since when a participant has waited."""
        self._waiting_since.pop(name, None)

    def has_waited_in_vain(self, name: str) -> bool:
        """Returns whether a participant has waited for the time of the waiting room."""
        since = self._waiting_since.get(name)
        return since is not None and time.monotonic() - since >= self._study.waiting_room.seconds

    def wait_on(self, person: Participant) -> None:
        """Lets a participant wait for the time of the waiting room once more."""
        check_stage(person.stage, Stage.LOBBY)
        self._waiting_since[person.id] = time.monotonic()

    def give_up(self, person: Participant) -> None:
        """Ends the participation of a person who has waited in vain; the group of later sessions is broken."""
        check_stage(person.stage, Stage.LOBBY)
        if not self.has_waited_in_vain(person.id):
            raise RefusedError("Please wait a little longer.")
        with self._records.transaction():
            if person.position == 0:
                self._records.set_stage(person.id, Stage.DEBRIEFING, outcome=Outcome.NO_PARTNER)
            else:
                group = self._records.group_of(person.id)
                assert group is not None
                self._records.set_group_state(group.id, "broken")
                stage = next_stage(self._study, Stage.AFTER_SESSION)
                self._records.set_stage(person.id, stage, outcome=Outcome.INTERRUPTED)
        self.forget(person.id)

    def pair(self) -> bool:
        """Forms groups of people who wait and are present, and continues groups; returns whether any session begins."""
        waiting = self._waiting()
        fresh = [(person.id, person.role) for person in waiting if person.position == 0 and person.role is not None]
        begun = False
        for slot, members in match(self._assigner, fresh, self._records.taken_slots()):
            with self._records.transaction():
                self._begin(self._records.add_group(slot, members), 0)
            begun = True
        later = [self._records.group_of(person.id) for person in waiting if person.position > 0]
        for group in {group.id: group for group in later if group is not None}.values():
            ready = [person for person in waiting if person.id in group.members.values()]
            if self._records.is_broken(group.id):
                for person in ready:
                    stage = next_stage(self._study, Stage.AFTER_SESSION)
                    self._records.set_stage(person.id, stage, outcome=Outcome.INTERRUPTED)
                begun = True
            elif len(ready) == len(group.members) and len({person.position for person in ready}) == 1:
                self._begin(group, ready[0].position)
                begun = True
        return begun

    def _waiting(self) -> list[Participant]:
        """Returns the people in the waiting room who are present, the longest waiting first."""
        people = [self._records.participant(name) for name in self._presence.present()]
        lobby = {each.id: each for each in people if each is not None and each.stage is Stage.LOBBY}
        now = time.monotonic()
        self._waiting_since = {name: self._waiting_since.get(name, now) for name in lobby}
        return sorted(lobby.values(), key=lambda person: self._waiting_since[person.id])

    def _begin(self, group: Group, position: int) -> None:
        row = self._records.sessions(group.id)[position]
        with self._records.transaction():
            for name in group.members.values():
                self._records.set_stage(name, Stage.SESSION, position=position)
        logger.info("session %s begins: condition %s", row.id, row.condition)
        self._rooms.open_session(row, group.members)
