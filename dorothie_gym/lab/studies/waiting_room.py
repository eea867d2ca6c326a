"""Roles, and the waiting room: pairing of people who are present, later sessions of a group, and expired waits."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Final

from dorothie_gym.lab.studies.assignment import Assigner, Candidate, changed_role, match, needed_role
from dorothie_gym.lab.studies.stages import Outcome, RefusedError, Stage, check_stage, next_stage

if TYPE_CHECKING:
    from dorothie_gym.lab.studies.open_rooms import OpenRooms
    from dorothie_gym.lab.studies.presence import Presence
    from dorothie_gym.lab.studies.record_types import Group, Participant, SessionRow
    from dorothie_gym.lab.studies.records import StudyRecords
    from dorothie_gym.lab.studies.study import Study

logger = logging.getLogger(__name__)

GONE_SECONDS: Final = 20.0
"""Time after the last sign of a page after which its person no longer counts as available [s]; a reload takes time."""

CERTAINTY: Final = {Stage.LOBBY: 1.0, Stage.TUTORIAL: 0.93, Stage.INSTRUCTIONS: 0.85}
"""Share of people at the stages before a session who come to it, if 30 % of all drop out (`benchmarks/arrivals.py`)."""

MOVABLE: Final = (Stage.INSTRUCTIONS, Stage.TUTORIAL)
"""Stages at which a role can change: the person then reads the new instructions, and practises in the new role."""


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
        self._looked_at: list[Candidate] = []
        self._opened = time.monotonic()

    def present(self) -> list[tuple[Participant, float]]:
        """Returns the people who wait and are present, and since when [s]; the longest waiting first."""
        now = time.monotonic()
        return [(person, now - self._waiting_since[person.id]) for person in self._waiting()]

    def forget(self, name: str) -> None:
        """Clears the start of a participant's wait."""
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
        """Ends the participation of a person for whom no partner was found; the group of later sessions is broken."""
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

    # --- roles ------------------------------------------------------------------------------------------------------

    def give_role(self, person: Participant) -> None:
        """Gives a person the role that is missing among the people present; does nothing for a person with a role."""
        if person.role is None:
            there = [each for each in self._there() if each.name != person.id]
            number = self._records.number(person.id)
            role = needed_role(self._assigner, there, self._records.taken_slots(), number)
            self._records.set_role(person.id, role)

    def mend_roles(self) -> bool:
        """Changes the role of a person who reads the instructions or practises, if others would find no partner.

        Returns:
            Whether a role has changed.
        """
        there = self._there()
        if there == self._looked_at or time.monotonic() - self._opened < GONE_SECONDS:  # pages reconnect first
            return False
        self._looked_at = there
        change = changed_role(self._assigner, there, self._records.taken_slots())
        if change is None:
            return False
        person, role = change
        logger.info("a person who is not yet in the waiting room gets another role, as the partner has left")
        with self._records.transaction():
            self._records.set_role(person.name, role)
            self._records.set_stage(person.name, Stage.INSTRUCTIONS)
        tutorial = self._rooms.tutorial_of(person.name)
        if tutorial is not None:
            self._rooms.close(tutorial)  # it is one of the other role
        return True

    def _there(self) -> list[Candidate]:
        """Returns the people present who have a role and play no session yet, the nearest to a session first."""
        people = [self._records.participant(name) for name in self._presence.present(GONE_SECONDS)]
        found = [each for each in people if each is not None and each.position == 0 and each.stage in CERTAINTY]
        now, order = time.monotonic(), list(CERTAINTY)
        found.sort(key=lambda each: (order.index(each.stage), self._waiting_since.get(each.id, now)))
        return [
            Candidate(name=each.id, role=each.role, certainty=CERTAINTY[each.stage], movable=each.stage in MOVABLE)
            for each in found
            if each.role is not None
        ]

    # --- sessions ---------------------------------------------------------------------------------------------------

    def pair(self) -> bool:
        """Forms groups of people who wait and are present, and continues groups; returns whether any session begins."""
        waiting = self._waiting()
        fresh = [(person.id, person.role) for person in waiting if person.position == 0 and person.role is not None]
        begun = False
        for slot, members in match(self._assigner, fresh, self._records.taken_slots()):
            with self._records.transaction():
                group = self._records.add_group(slot, members)
                row = self._begin(group, 0)
            self._rooms.open_session(row, group.members)  # not before the group is stored
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
                self._rooms.open_session(self._begin(group, ready[0].position), group.members)
                begun = True
        return begun

    def _waiting(self) -> list[Participant]:
        """Returns the people in the waiting room who are present, the longest waiting first."""
        people = [self._records.participant(name) for name in self._presence.present()]
        lobby = {each.id: each for each in people if each is not None and each.stage is Stage.LOBBY}
        now = time.monotonic()
        self._waiting_since = {name: self._waiting_since.get(name, now) for name in lobby}
        return sorted(lobby.values(), key=lambda person: self._waiting_since[person.id])

    def _begin(self, group: Group, position: int) -> SessionRow:
        row = self._records.sessions(group.id)[position]
        with self._records.transaction():
            for name in group.members.values():
                self._records.set_stage(name, Stage.SESSION, position=position)
        logger.info("session %s begins: condition %s", row.id, row.condition)
        return row
