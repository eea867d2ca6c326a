"""Steps of the way that the participant has asked for, and that wait for their place: a note for the Co-Wizard."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.plan_words import spoken_step
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.co_wizard.config import CoWizardStyle
from dorothie_gym.policies.co_wizard.policy import ScriptedCoWizard
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.heard_utterance import heard_utterance

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.session.session_engine import SessionEngine
    from dorothie_gym.session.spaces.observations import ObservationMapping

EVERY: Final = 0.5
"""Time between looks at the road [s]; words of the participant are heard at once."""

_ATTENTIVE: Final = CoWizardStyle(echoes=0.0, checks=0.0, announces=0.0, silent=1.0)


class AskedSteps:
    """Memory of a scripted Co-Wizard that listens and watches the road, and is heard and obeyed by nobody.

    It sees what the person at the seat sees, and nothing else.

    Args:
        engine: engine of the sessions.
    """

    def __init__(self, engine: SessionEngine) -> None:
        self._engine = engine
        self._policy = ScriptedCoWizard(engine.limits, style=_ATTENTIVE)
        self._state: CoWizardState | None = None
        self._time = -math.inf

    def begin(self, seed: int) -> None:
        """Forgets the steps of the session before.

        Args:
            seed: seed of the session.
        """
        self._state = self._policy.initial_state(policy_seed(seed, Role.CO_WIZARD), self._engine.town)
        self._time = -math.inf

    def hear(self, observation: ObservationMapping) -> None:
        """Takes over what is asked for in a decision, and drops what is done.

        Args:
            observation: observation of the Co-Wizard.
        """
        time = float(observation["time"][0])
        if self._state is None or (
            time < self._time + EVERY and heard_utterance(observation, Role.PARTICIPANT) is None
        ):
            return
        self._time = time
        _, self._state = self._policy.step(observation, self._state)

    @property
    def words(self) -> list[str]:
        """Steps that wait, in order: "left", "right after the second traffic light"."""
        return [] if self._state is None else [spoken_step(step) for step in self._state.plan.steps]
