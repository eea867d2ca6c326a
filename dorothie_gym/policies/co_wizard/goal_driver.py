"""Driver that brings the car to places on the map: the scripted Co-Wizard's driving without its dialogue."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.policies.co_wizard.config import CoWizardStyle
from dorothie_gym.policies.co_wizard.destinations import aim, known_landmark
from dorothie_gym.policies.co_wizard.driving import drive, end_red_light_rest
from dorothie_gym.policies.co_wizard.policy import ScriptedCoWizard, update_route
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.session.spaces.actions import CoWizardAction

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.ontology.slots import LandmarkName
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping


class GoalDriver:
    """Drives to a place that is set as goal, stops there, and reports goal and plan as belief updates.

    It reads what the Co-Wizard observes. It neither understands words nor speaks, and knows no roadblocks: whoever sets
    the goal sees to it that the car turns round.

    Args:
        town: the map.
        limits: sizes of the spaces.
    """

    def __init__(self, town: Town, limits: SpaceLimits | None = None) -> None:
        self._state = ScriptedCoWizard(
            limits, style=CoWizardStyle(echoes=0.0, checks=0.0, announces=0.0, silent=1.0)
        ).initial_state(0, town)
        self._view: CoWizardView | None = None

    @property
    def goal(self) -> LandmarkName | None:
        """Place to which the car is driven; None without one."""
        return self._state.beliefs.goal

    @property
    def arrived(self) -> bool:
        """Whether the car has stopped at the goal."""
        return self._state.intentions.arrived

    @property
    def view(self) -> CoWizardView:
        """The latest observation; raises `RuntimeError` before the first one."""
        if self._view is None:
            raise RuntimeError("the driver has observed nothing: call observe first")
        return self._view

    def observe(self, observation: ObservationMapping) -> None:
        """Updates the route with an observation, once in each decision."""
        state, _ = self._state.next_decision()
        self._view = CoWizardView.read(observation, state.town)
        state.clock = state.clock.ticked(self._view.time)
        update_route(state, self._view)
        self._state = state

    def knows(self, name: LandmarkName) -> bool:
        """Returns whether a place is on the map."""
        return known_landmark(self._state, self.view, name, ()) is not None

    def set_goal(self, name: LandmarkName) -> None:
        """Plans the way to a place on the map; raises `ValueError` if it is not there."""
        mark = known_landmark(self._state, self.view, name, ())
        if mark is None:
            raise ValueError(f"{name.label} is not on the map")
        aim(self._state, self.view, mark)
        self._state.intentions = self._state.intentions.started()

    def leave_goal(self) -> None:
        """Drops goal and route; the car goes on by its own rules."""
        self._state.leave_goal()
        self._state.intentions = self._state.intentions.started()

    def act(self) -> CoWizardAction:
        """Returns the next command on the way to the goal, and the next belief update."""
        state = self._state
        physical = None
        if self.goal is not None:
            end_red_light_rest(state, self.view)
            physical = drive(state, self.view)
        updates = state.beliefs.updates
        if updates:
            state.beliefs = state.beliefs.after_sending()
        return CoWizardAction(physical=physical, mental=updates[0] if updates else None)
