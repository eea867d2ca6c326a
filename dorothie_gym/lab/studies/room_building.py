"""Rooms of a study: tutorial drives, sessions, and sessions that a stopped server left behind."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from dorothie_gym.evaluation.rollout.replay import begin_replay
from dorothie_gym.lab.console.config import AbsenceRules, AfterAbsence, ConsoleConfig, WhileAway
from dorothie_gym.lab.console.resuming import Resumed
from dorothie_gym.lab.console.room import Room
from dorothie_gym.lab.console.seating import plan_seat
from dorothie_gym.lab.studies.record_types import SESSIONS_FOLDER, SessionRow
from dorothie_gym.lab.studies.study import HUMAN, Scenario, Study
from dorothie_gym.lab.studies.study_file import sources
from dorothie_gym.lab.town_page import town_page
from dorothie_gym.maps.catalogue import load_town
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.recording.files import SessionState
from dorothie_gym.session.recording.session import Session, session_state
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.tasks.parsing import load_template

logger = logging.getLogger(__name__)

STUDY_FIELD: Final = "study"
"""Field of the header of a session with its condition and the pseudonymous ids of the people."""


class RoomBuilder:
    """Builds rooms; each takes seconds, so that it happens on threads.

    Args:
        study: the study.
        sources: folder of its file, for names of files in it.
        folder: folder of the study's data.
    """

    def __init__(self, study: Study, sources: Path, folder: Path) -> None:
        self._study, self._sources = study, sources
        self._folder = folder / SESSIONS_FOLDER

    def tutorial(self, role: Role) -> Room:
        """Returns a room with scripted partners, which records nothing and stops while its person is away."""
        tutorial = self._study.tutorial
        assert tutorial is not None
        absence = AbsenceRules(while_away=WhileAway.PAUSE, then=AfterAbsence.WAIT)
        config = replace(self._config(tutorial.seconds, 0.0, absence), tier=None)
        plans = {each: plan_seat(HUMAN if each is role else "scripted", each) for each in AGENT_ROLES}
        return Room(self._engine(tutorial.scenario, config), plans, config, seed=self._study.assignment.seed)

    def session(self, row: SessionRow, people: Mapping[Role, str]) -> Room:
        """Returns the room of a session, which is resumed if a stopped server left its recording.

        Args:
            row: the session.
            people: ids of the participants, by role.

        Raises:
            SessionError: the record that was left behind cannot be read.
        """
        condition = self._study.condition(row.condition)
        rules = self._study.absence
        absence = AbsenceRules(while_away=rules.while_away, seconds=rules.seconds, then=rules.then)
        config = self._config(self._study.session.max_seconds, condition.word_error_rate, absence)
        plans = {role: plan_seat(player, role) for role, player in condition.players.items()}
        ids = {role.value: name for role, name in people.items()}
        extra = {STUDY_FIELD: {"session": row.id, "condition": row.condition, "participants": ids}}
        scenario, resumed = Scenario(town=row.town, storyboard=row.storyboard), self._left_behind(row)
        if resumed is None:
            engine = self._engine(scenario, config)
        else:
            logger.info("session %s goes on after a restart of the server", row.id)
            town, storyboard = sources(scenario, self._sources)
            template = None if storyboard is None else load_template(storyboard)
            engine = begin_replay(resumed.session, load_town(town), storyboard=template)
            town_page(engine.town)
        return Room(
            engine, plans, config, seed=row.seed, folder=self._folder, name=row.id, extra=extra, resumed=resumed
        )

    def state(self, row: SessionRow) -> SessionState:
        """Returns the state of the record of a session."""
        return SessionState.ABSENT if row.folder is None else session_state(self._folder / row.folder)

    def summary(self, row: SessionRow) -> Mapping[str, object] | None:
        """Returns the outcome of a session whose record is complete; None if it is not."""
        if row.folder is None or self.state(row) is not SessionState.FINISHED:
            return None
        return Session.load(self._folder / row.folder).summary

    def _left_behind(self, row: SessionRow) -> Resumed | None:
        if row.folder is None or self.state(row) is not SessionState.PARTIAL:
            return None
        return Resumed.load(self._folder / row.folder)

    def _config(self, seconds: float, word_error_rate: float, absence: AbsenceRules) -> ConsoleConfig:
        return ConsoleConfig(
            max_seconds=seconds,
            word_error_rate=word_error_rate,
            pictures=self._study.session.pictures,
            speech=self._study.session.speech,
            absence=absence,
            repeatable=False,
            tier=self._study.session.tier,
        )

    def _engine(self, scenario: Scenario, config: ConsoleConfig) -> SessionEngine:
        town, storyboard = sources(scenario, self._sources)
        engine = SessionEngine(town, storyboard, config=config.environment())
        town_page(engine.town)  # browsers are served at once
        return engine
