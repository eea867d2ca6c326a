"""`render()` of the navigation environments."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.navigation.instructor import words_of

if TYPE_CHECKING:
    from dorothie_gym.envs.navigation.batch import DrivingBatch
    from dorothie_gym.envs.session_view import Notes, SessionView
    from dorothie_gym.session.live_session import LiveSession


class DrivingView:
    """Pictures of an environment of a batch; without a render mode there is none.

    Attributes:
        view: the picture.
    """

    def __init__(self, view: SessionView) -> None:
        self.view = view
        self._live: LiveSession | None = None
        self._shown = -math.inf  # time of the last instruction that was noted [s]

    @property
    def notes(self) -> tuple[Notes, float]:
        """Notes on the session, for a state of the environment."""
        return self.view.notes, self._shown

    def apply_values(self, notes: tuple[Notes, float], live: LiveSession) -> None:
        """Applies the notes of a state to the same session, see `SessionView.apply_values`."""
        self._live = live
        drawn, self._shown = notes
        self.view.apply_values(drawn, live)

    def note(self, batch: DrivingBatch, place: int) -> None:
        """Records the current decision of an environment."""
        live, said = batch.catch_up(place), batch.heard(place).instruction
        if live is self._live:
            live.begin_decision()
            live.note_place()
        else:
            self._live, self._shown = live, -math.inf
            self.view.begin(live)
        if said is not None and said.time > self._shown:
            self.view.note_instruction(said.time, words_of(said), str(said.act))
            self._shown = said.time
        self.view.note(live.observations((Role.CO_WIZARD,))[Role.CO_WIZARD])
