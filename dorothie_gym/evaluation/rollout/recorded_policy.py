"""Policy that takes the recorded actions of a role, for sessions in which the other roles are played again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout.play import PERSONAS
from dorothie_gym.policies.policy import Policy
from dorothie_gym.session.recorder import expand, idle_actions

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.recording.session import Session
    from dorothie_gym.session.spaces.actions import ActionDict
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping


class RecordedPolicy(Policy[int]):
    """Takes the actions of a role in a recorded session, independently of its observations; its state is the frame.

    Args:
        session: session with recorded decisions.
        role: role whose actions are taken.
        frames: number of frames from one decision to the next.
        limits: sizes of the role's spaces.

    Raises:
        SessionError: the session has no recorded decisions; `step` raises it for a malformed action.
    """

    observes = False

    def __init__(self, session: Session, role: Role, *, frames: int, limits: SpaceLimits | None = None) -> None:
        super().__init__(role, limits)
        if session.decisions is None:
            raise SessionError(f"{session.name}: what the roles decided was not recorded; it cannot be played again")
        self._decisions = {decision.frame: decision for decision in session.decisions}
        self._idle = idle_actions(self.limits)[str(role)]
        self._persona = recorded_persona(session, role)
        self._frames = frames

    def initial_state(self, seed: int, town: Town) -> int:
        """Returns the frame of the first decision."""
        return 0

    def persona_of(self, state: int) -> Mapping[str, float | str] | None:
        """Returns the persona in the header of the session."""
        return self._persona

    def step(self, observation: ObservationMapping, state: int) -> tuple[ActionDict, int]:
        """Returns the action recorded at the frame, and the frame of the next decision."""
        decision = self._decisions.get(state)
        action = self._idle if decision is None else expand(decision, self.limits)[str(self.role)]
        return action, state + self._frames


def recorded_persona(session: Session, role: Role) -> dict[str, float | str] | None:
    """Returns the persona of a role in a header; None if there is none, or if its traits are not numbers or texts."""
    personas = session.header.extra.get(PERSONAS)
    persona = personas.get(str(role)) if isinstance(personas, Mapping) else None
    if not isinstance(persona, Mapping):
        return None
    traits = {str(name): value for name, value in persona.items() if isinstance(value, float | int | str)}
    return traits if len(traits) == len(persona) else None
