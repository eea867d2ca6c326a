"""Interference of the scripted Ad-Wizard with a session in which an agent drives."""

from __future__ import annotations

from collections.abc import Mapping

from dorothie_gym.engine.scenario import Scenario
from dorothie_gym.maps import Town
from dorothie_gym.ontology import Role
from dorothie_gym.policies.ad_wizard import ScriptedAdWizard, idle_until
from dorothie_gym.policies.policy import policy_seed
from dorothie_gym.spaces import ActionDecoder, Observation, RoleAction, SpaceLimits, plain_text
from dorothie_gym.spaces.limits import STORY_LENGTH


class Interference:
    """Scripted Ad-Wizard of a session; it is asked for an action only when it may act.

    Attributes:
        due: earliest time at which it may act [s].
    """

    def __init__(self, town: Town, limits: SpaceLimits, scenario: Scenario, rate: float) -> None:
        """Draws its plans.

        Args:
            town: the map.
            limits: sizes of the spaces.
            scenario: scenario of the session.
            rate: average number of exceptions in a session.
        """
        self._policy = ScriptedAdWizard(limits, rate=rate)
        self._decoder = ActionDecoder(Role.AD_WIZARD, limits)
        self._plans = self._policy.initial_state(policy_seed(scenario.seed, Role.AD_WIZARD), town)
        self._story = plain_text(scenario.storyboard.story, STORY_LENGTH)
        self.due = idle_until(self._policy, self._plans, self._story)

    def wait(self, decisions: int = 1) -> None:
        """Counts decisions at which it does not act."""
        self._plans = self._plans.advanced(decisions)

    def act(self, seen: Mapping[str, Observation]) -> RoleAction:
        """Returns its action at a decision by the observations of the session."""
        action, self._plans = self._policy.step(seen[Role.AD_WIZARD], self._plans)
        self.due = idle_until(self._policy, self._plans, self._story)
        return self._decoder(action)
