"""Progress of participants through a study: permitted requests at each stage, and the end of sessions."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from dorothie_gym.lab.studies.assignment import Assigner
from dorothie_gym.lab.studies.erasure import erase_from_data, finish_erasures
from dorothie_gym.lab.studies.items import Answer, check_answers
from dorothie_gym.lab.studies.stages import QUESTIONNAIRES, Outcome, RefusedError, Stage, check_stage, next_stage
from dorothie_gym.lab.studies.waiting_room import WaitingRoom
from dorothie_gym.session.recording.events import EndReason

if TYPE_CHECKING:
    from dorothie_gym.lab.studies.open_rooms import OpenRoom, OpenRooms
    from dorothie_gym.lab.studies.presence import Presence
    from dorothie_gym.lab.studies.record_types import Participant, SessionRow
    from dorothie_gym.lab.studies.records import StudyRecords
    from dorothie_gym.lab.studies.study import Study

logger = logging.getLogger(__name__)

COMPLETE: Final = (EndReason.ARRIVED.value, EndReason.OUT_OF_TIME.value)
"""Reasons for the end of sessions that count as played."""


class Progress:
    """Participants of a running study.

    All methods are for the event loop.

    Args:
        study: the study.
        records: records of the study.
        rooms: open rooms.
        presence: people whose browsers are connected.

    Attributes:
        waiting: the waiting room.
        present: returns the ids of the people whose browsers are connected.
    """

    def __init__(self, study: Study, records: StudyRecords, rooms: OpenRooms, presence: Presence) -> None:
        self.study, self.records, self.rooms = study, records, rooms
        self.assigner = Assigner(study)
        self.present = presence.present
        self._left: list[str] = []
        self.waiting = WaitingRoom(study, records, rooms, presence, self.assigner)

    # --- stages -----------------------------------------------------------------------------------------------------

    def consent(self, person: Participant, agreed: Sequence[bool]) -> None:
        """Begins the study for a person who has agreed to all statements."""
        check_stage(person.stage, Stage.CONSENT)
        if list(agreed) != [True] * len(self.study.statements):
            raise RefusedError("Please agree to every statement, or do not take part.")
        with self.records.transaction():
            self._advance(person)

    def decline(self, person: Participant) -> None:
        """Deletes a person who does not agree."""
        check_stage(person.stage, Stage.CONSENT)
        self._forget([person.id])

    def answer(self, person: Participant, stage: Stage, answers: Mapping[str, Answer]) -> None:
        """Stores the answers to the questionnaire of a stage; raises `AnswerError` if they are not allowed."""
        check_stage(person.stage, stage)
        if stage not in QUESTIONNAIRES:
            raise RefusedError("There is no questionnaire at this point.")
        name = QUESTIONNAIRES[stage]
        checked = check_answers(self.study.questionnaire(name), answers)
        with self.records.transaction():
            position = person.position - 1 if stage is Stage.AFTER_SESSION else 0
            self.records.answer(person.id, name, position, checked)
            self._advance(person)

    def proceed(self, person: Participant, stage: Stage) -> None:
        """Ends a stage at the request of its participant."""
        check_stage(person.stage, stage)
        if stage is Stage.SESSION:
            self._leave_session(person)
            return
        if stage not in (Stage.INSTRUCTIONS, Stage.TUTORIAL, Stage.DEBRIEFING):
            raise RefusedError("This step cannot be skipped.")
        tutorial = self.rooms.tutorial_of(person.id)
        if tutorial is not None:
            self.rooms.close(tutorial)
        with self.records.transaction():
            self._advance(person)

    def _advance(self, person: Participant) -> None:
        more = self._plays_on(person)
        cut_short = person.stage is Stage.AFTER_SESSION and not more and person.outcome is None
        outcome = Outcome.INTERRUPTED if cut_short else None
        stage = next_stage(self.study, person.stage, more_sessions=more)
        if stage is Stage.INSTRUCTIONS:
            self.waiting.give_role(person)  # as late as possible: the instructions are those of the role
        self.records.set_stage(person.id, stage, outcome=outcome)

    def _plays_on(self, person: Participant) -> bool:
        group = self.records.group_of(person.id)
        return group is not None and person.position < self.study.sessions_each and not self.records.is_broken(group.id)

    def _leave_session(self, person: Participant) -> None:
        """Moves a participant whose session has ended to the next stage."""
        row = self.session_of(person)
        if row is None or row.reason is None:
            raise RefusedError("The session is still in progress.")
        group = self.records.group(row.group)
        broken, last = self.records.is_broken(group.id), row.position + 1 >= self.study.sessions_each
        stage, outcome = next_stage(self.study, Stage.SESSION), person.outcome
        if outcome is None and (broken or last):
            outcome = Outcome.COMPLETED if row.reason in COMPLETE and last else Outcome.INTERRUPTED
        if outcome is None and stage is not Stage.AFTER_SESSION:
            stage = Stage.LOBBY  # there is no questionnaire between sessions
        with self.records.transaction():
            self.records.set_stage(person.id, stage, outcome=outcome, position=row.position + 1)
        place = self.rooms.of_session(row.id)
        members = [self.records.participant(name) for name in group.members.values()]
        if place is not None and not any(each is not None and each.stage is Stage.SESSION for each in members):
            self.rooms.close(place)

    # --- sessions ---------------------------------------------------------------------------------------------------

    def session_of(self, person: Participant) -> SessionRow | None:
        """Returns the current session of a participant."""
        group = self.records.group_of(person.id)
        return None if group is None else self.records.sessions(group.id)[person.position]

    def seat_token(self, person: Participant) -> str | None:
        """Returns the token of the participant's seat in a tutorial or session; opens the room if it is not open."""
        if person.stage is Stage.TUTORIAL:
            assert person.role is not None
            return self.rooms.token(self.rooms.open_tutorial(person.id, person.role), person.id)
        row = self.session_of(person)
        if row is None or (row.reason is not None and self.rooms.of_session(row.id) is None):
            return None
        group = self.records.group(row.group)
        return self.rooms.token(self.rooms.open_session(row, group.members), person.id)

    def reopen(self) -> None:
        """Opens the rooms of sessions that were in progress when the last server stopped.

        Ends that the last server could no longer record are recorded.
        """
        for row in self.records.sessions():
            summary = None if row.reason is not None else self.rooms.summary_left_behind(row)
            if summary is not None:
                self._note_summary(row, str(summary["reason"]), summary)
                continue
            group = self.records.group(row.group)
            people = [self.records.participant(name) for name in group.members.values()]
            if (
                row.reason is None
                and people
                and all(p is not None and p.stage is Stage.SESSION and p.position == row.position for p in people)
            ):
                self.rooms.open_session(row, group.members)

    def note_ends(self) -> bool:
        """Records the ends of finished sessions; returns whether there were any."""
        ended = False
        for place in self.rooms.finished():
            assert place.session is not None and place.room is not None
            row = next(
                (each for each in self.records.sessions(place.session.group) if each.id == place.session.id), None
            )
            if row is None or row.reason is not None:
                continue
            ended = True
            self._note_end(place, row)
        return ended

    def _note_end(self, place: OpenRoom, row: SessionRow) -> None:
        room = place.room
        assert room is not None
        summary = room.engine.summary()
        reason = EndReason.TECHNICAL.value if room.failed else str(summary["reason"])
        with self.records.transaction():
            self.records.set_folder(row.id, None if room.record is None else room.record.folder.name)
            self._note_summary(row, reason, summary)
            self._note_absent(place, reason)

    def _note_summary(self, row: SessionRow, reason: str, summary: Mapping[str, Any]) -> None:
        logger.info("session %s is over: %s", row.id, reason)
        with self.records.transaction():
            self.records.finish_session(
                row.id, reason, success=bool(summary["success"]), seconds=float(summary["seconds"])
            )
            if reason not in COMPLETE:
                self.records.set_group_state(row.group, "broken")
            elif row.position + 1 >= self.study.sessions_each:
                self.records.set_group_state(row.group, "completed")

    def _note_absent(self, place: OpenRoom, reason: str) -> None:
        """Records the person who left a session that ended for this reason."""
        assert place.room is not None
        for role, name in place.people.items():
            if reason == EndReason.LEFT.value and not place.room.seats[role.value].present:
                self.records.set_outcome(name, Outcome.LEFT)

    def dissolve(self, place: OpenRoom) -> None:
        """Sends the people of a session that did not begin, because some did not come, back to the waiting room."""
        row = place.session
        assert row is not None
        logger.info("session %s did not begin: not everybody came", row.id)
        self.rooms.close(place)
        with self.records.transaction():
            for name in place.people.values():
                if self.records.participant(name) is not None:
                    self.records.set_stage(name, Stage.LOBBY)
            if row.position == 0:
                self.records.dissolve(row.group)
            else:
                self.records.set_group_state(row.group, "broken")

    def forget_undecided(self) -> None:
        """Deletes people who neither agreed nor declined and have not been seen for long."""
        names = self.records.undecided()
        if names:
            self._forget(names)

    def _forget(self, names: Sequence[str]) -> None:
        """Deletes people who have given no consent; their invitations can be used again."""
        with self.records.transaction():
            for name in names:
                self.records.free_invitation(name)
            erase_from_data(self.records, *names)
        self.finish_erasures()

    # --- withdrawal -------------------------------------------------------------------------------------------------

    async def withdraw(self, person: Participant) -> bool:
        """Deletes all data of a person; a session in progress ends for all its people.

        Returns:
            Whether all data are removed; otherwise the server tries again.

        Raises:
            StorageError: nothing is deleted; the person takes part as before.
        """
        row = self.session_of(person) if person.stage is Stage.SESSION else None
        places = [self.rooms.tutorial_of(person.id), None if row is None else self.rooms.of_session(row.id)]
        erase_from_data(self.records, person.id)
        self.waiting.forget(person.id)
        logger.info("a participant has withdrawn")
        for place in places:
            if place is not None:
                try:
                    await self.rooms.stop(place, EndReason.LEFT)
                except Exception:  # such as a full disk; the record is removed all the same
                    logger.exception("a room of a person who has withdrawn could not be closed")
        return self.finish_erasures()

    def finish_erasures(self) -> bool:
        """Removes the data of deleted people from other files; returns whether all are removed."""
        left = finish_erasures(self.records)
        for each in left if left != self._left else []:
            logger.warning("still to be deleted: %s", each)
        self._left = left
        return not left

    def retry_erasures(self) -> None:
        """Retries failed deletions."""
        if self._left:
            self.finish_erasures()
