"""Verdict on a talk task that an agent plays: the tiers "ask-first" and "admit-it"."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.evaluation.closed_loop.talk_verdict import verdict_of
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.recording.trajectory import TRAJECTORY_DTYPE
from dorothie_gym.session.scenario import header_of

if TYPE_CHECKING:
    from dorothie_gym.evaluation.closed_loop.talk_verdict import TalkVerdict
    from dorothie_gym.session.recording.events import Event
    from dorothie_gym.session.session_engine import SessionEngine


class TalkReferee:
    """Referee of a talk task: keeps the events of the session, and judges them.

    Args:
        engine: engine that has just been reset.
    """

    def __init__(self, engine: SessionEngine) -> None:
        self._engine = engine
        self._events: list[Event] = []
        self._header = header_of(engine.scenario, engine.town.name, engine.config)
        self.note()

    def note(self) -> None:
        """Notes the events of the last decision."""
        self._events += self._engine.last_events

    def verdict(self) -> TalkVerdict | None:
        """Returns the verdict on the session so far; None if it has no talk task.

        It is that of the recorded session, and final once the task is decided.
        """
        trajectory = np.empty(0, dtype=TRAJECTORY_DTYPE)
        session = Session(header=self._header, events=tuple(self._events), trajectory=trajectory)
        return verdict_of(session, self._engine.town)
