"""Policy that lets a trained driver of `Navigation-v0` drive as the Co-Wizard; the scripted Co-Wizard talks for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import PolicyStateError
from dorothie_gym.maps.model import LinkType
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, StreetName
from dorothie_gym.policies.co_wizard.config import CoWizardStyle
from dorothie_gym.policies.co_wizard.driving import CRUISE_TOLERANCE, distance_ahead, wanted_exit
from dorothie_gym.policies.co_wizard.intentions import Wish
from dorothie_gym.policies.co_wizard.policy import ScriptedCoWizard, attend, respond
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.navigation.actions import EstimatedActionMask, NavigationAction, physical_of
from dorothie_gym.policies.navigation.driver_view import driver_of
from dorothie_gym.policies.navigation.instructor import GuidanceStep, NavigationInstruction
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, nearest_sector
from dorothie_gym.policies.navigation.observation_fields import DECISION_FREQUENCY, MAX_SECONDS, Vector
from dorothie_gym.policies.navigation.observation_vector import HeardInstruction, NavigationEncoder
from dorothie_gym.policies.policy import Policy, replace
from dorothie_gym.policies.route_progress import stopping_distance
from dorothie_gym.policies.scripted_agent_limits import NUDGE_DISTANCE, GuidanceConfig
from dorothie_gym.session.spaces.actions import ActionDict, Physical
from dorothie_gym.session.spaces.observations import ObservationMapping
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Place
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.session.spaces.fields import SpaceLimits

ARRIVED_WITHIN = 3.0
"""Distance to its destination within which a standing car is taken to have arrived [m]; wider than the instructor's
own limit, because the position is an estimate."""

NUDGED_WITHIN = NUDGE_DISTANCE / 2
"""Distance to the end of a nudge within which a standing car is taken to have completed it [m]."""

_GUIDANCE = GuidanceConfig()


@dataclass(frozen=True, kw_only=True)
class InstructionState:
    """Memory of the instructions heard.

    Attributes:
        heard: last instruction as it is observed by a driver.
        key: identity of that instruction; an instruction with another key is a new one.
    """

    heard: HeardInstruction = field(default_factory=HeardInstruction)
    key: tuple[object, ...] = ()

    def renewed(self, state: CoWizardState, view: CoWizardView, exits: JunctionExits) -> InstructionState:
        """Returns the memory after another decision: with a new instruction, or the same one again after a while."""
        step = next_step(state, view, exits)
        if step is None:
            return replace(self, heard=replace(self.heard, goal=None))
        goal = destination(state) if step.key[0] == "goal" else None
        last = self.heard.instruction
        if last is not None and step.key == self.key and view.time - last.time < _GUIDANCE.repeat_after:
            return replace(self, heard=replace(self.heard, goal=goal))
        act = DialogueAct.of(DialogueMove.INSTRUCT, *step.values)
        given = NavigationInstruction(act=act, sector=step.sector, distance=step.distance, time=view.time)
        return InstructionState(heard=HeardInstruction(instruction=given, goal=goal), key=step.key)


def destination(state: CoWizardState) -> Place | None:
    """Returns the place to which the car can drive unguided: a place on its map, or a guessed one."""
    if state.beliefs.stop_place is not None:
        return state.beliefs.stop_place
    return state.route.progress.goal if state.route.progress is not None else None


def next_step(state: CoWizardState, view: CoWizardView, exits: JunctionExits) -> GuidanceStep | None:
    """Returns the step to carry out now; None if there is none besides those already given.

    It is the step that the instructor of `Navigation-v0` would give: turns shortly before they are due, destinations
    by name, Stop with the distance to the stopping place.
    """
    intentions = state.intentions
    stopped = view.motion is Motion.STOPPED and view.standing
    if intentions.halted:
        return GuidanceStep(("stop",), (ActionValue.STOP,), None, stopping_distance(view.speed))
    if intentions.nudge is not None:
        left = max(distance_ahead(state, view, intentions.nudge) or 0.0, 0.0)
        action = ActionValue.START if stopped else ActionValue.STOP
        return GuidanceStep((action, intentions.nudge), (action,), None, left)
    if intentions.wish is not None:
        return _manoeuvre_step(state, view, intentions.wish)
    goal = destination(state)
    if intentions.directive is not None or goal is None:
        turn = _turn_step(state, view, exits)
        if turn is not None:
            return turn
    if goal is not None:
        name = state.beliefs.goal if state.beliefs.goal is not None else LandmarkName.UNKNOWN
        return GuidanceStep(("goal", goal), (name,))
    return GuidanceStep(("on",), (ActionValue.START,)) if stopped else None


def _manoeuvre_step(state: CoWizardState, view: CoWizardView, wish: Wish) -> GuidanceStep:
    """Returns a lane switch or a U-turn; a U-turn begins on the innermost lane."""
    inwards = state.town.traffic.to_middle
    if wish is Wish.U_TURN:
        if state.town.neighbour(view.lane, inwards) is None:
            return GuidanceStep(("round", view.lane), (ActionValue.U_TURN,))
        left = inwards is LinkType.LANE_CHANGE_LEFT
    else:
        left = wish is Wish.SWITCH_LEFT
    sector = nearest_sector(90.0 if left else -90.0)
    return GuidanceStep(("lane", view.lane, left), (ActionValue.LANE_SWITCH,), sector)


def _turn_step(state: CoWizardState, view: CoWizardView, exits: JunctionExits) -> GuidanceStep | None:
    """Returns the requested turn at the next junction, once the junction is near."""
    choice, way = view.choice, wanted_exit(state, view)
    if choice is None or way is None or choice.distance > _GUIDANCE.turn_distance:
        return None
    directive = state.intentions.directive
    street = directive.street if directive is not None else StreetName.UNKNOWN
    values = (ActionValue.J_TURN, street) if street is not StreetName.UNKNOWN else (ActionValue.J_TURN,)
    sector = exits.sector_of(choice.lane, way.connector)
    return GuidanceStep(("turn", choice.lane, way.connector), values, sector, choice.distance)


def note_driving(state: CoWizardState, view: CoWizardView) -> None:
    """Updates the intentions of the Co-Wizard from the car's motion, independently of the driver's commands.

    Args:
        state: working copy of the state.
        view: observation.
    """
    wish = state.intentions.wish
    turns = wish is Wish.U_TURN and view.manoeuvre is PhysicalAction.U_TURN
    switches = wish in (Wish.SWITCH_LEFT, Wish.SWITCH_RIGHT) and view.manoeuvre is PhysicalAction.LANE_SWITCH
    if turns or switches:
        state.intentions = state.intentions.without_wish()
    nudge = state.intentions.nudge
    place = nudge or state.beliefs.stop_place
    if place is None or state.intentions.halted:
        return
    left = distance_ahead(state, view, place)
    stands = view.standing and view.motion is Motion.STOPPED
    near = ARRIVED_WITHIN if nudge is None else NUDGED_WITHIN
    if stands and left is not None and abs(left) <= near:
        arrived = state.beliefs.goal is not None
        state.intentions = state.intentions.stopped_at_place(arrived=arrived, sent_on=nudge is not None)
        state.commands = state.commands.after_stop(view.time)
    elif nudge is not None and (left is None or left < -state.config.passed):
        state.intentions = state.intentions.without_nudge()


# --- policy -----------------------------------------------------------------------------------------------------------

Choose: TypeAlias = Callable[[Vector, NDArray[np.bool_]], int]
"""Driver: chooses one of the 18 actions from an observation of `Navigation-v0` (161,) and a mask (18,)."""

PLAIN_STYLE = CoWizardStyle(echoes=0.0, checks=0.0, announces=0.0, silent=0.0, asks=1.0)
"""Traits of the Co-Wizard that talks for a driver: it acknowledges instructions, asks for unknown ways, and answers."""

_EPSILON = 1e-6


@dataclass(frozen=True, kw_only=True)
class NavigationPolicyState:
    """State of a driver between decisions.

    Attributes:
        co_wizard: state of the scripted Co-Wizard that listens and talks.
        instructions: instructions heard.
        observation: observation of the Co-Wizard at the last decision; None before the first.
        decided_at: time of the last decision of the driver [s].
        speed: requested cruise speed that has been set [km/h].
    """

    co_wizard: CoWizardState
    instructions: InstructionState = field(default_factory=InstructionState)
    observation: ObservationMapping | None = None
    decided_at: float = -1.0
    speed: int

    @property
    def seen(self) -> ObservationMapping:
        """Observation at the last decision; raises `PolicyStateError` before the first."""
        if self.observation is None:
            raise PolicyStateError("the driver has observed nothing yet: update the state with an observation first")
        return self.observation


class DriverInputs:
    """Conversion of Co-Wizard observations in a town to observations and masks of `Navigation-v0`.

    Attributes:
        exits: exits of the town's junctions.
    """

    def __init__(self, town: Town, max_seconds: float) -> None:
        self.exits = JunctionExits(town)
        self._encoder = NavigationEncoder(town, self.exits, max_seconds)
        self._mask = EstimatedActionMask(town)

    def update(
        self,
        state: NavigationPolicyState,
        co_wizard: CoWizardState,
        view: CoWizardView,
        observation: ObservationMapping,
    ) -> NavigationPolicyState:
        """Returns the state after another observation; `co_wizard` has listened to it already and is updated."""
        instructions = state.instructions
        if state.observation is not None:
            instructions = replace(instructions, heard=instructions.heard.driven_on(state.observation, observation))
        note_driving(co_wizard, view)
        return replace(
            state,
            co_wizard=co_wizard,
            instructions=instructions.renewed(co_wizard, view, self.exits),
            observation=observation,
        )

    def observe(self, state: NavigationPolicyState) -> tuple[Vector, NDArray[np.bool_]]:
        """Returns observation (161,) and mask (18,) of the driver."""
        vector = self._encoder.observe(state.seen, state.instructions.heard, state.co_wizard.route.blocked)
        return vector, self._mask.mask(driver_of(state.seen, self.exits))


def has_nothing_to_do(state: NavigationPolicyState) -> bool:
    """Returns whether the policy is not queried: no instruction was given yet, or the car stands as instructed."""
    stopped = int(state.seen["motion"]) == Motion.STOPPED
    return state.instructions.heard.instruction is None or (state.co_wizard.intentions.halted and stopped)


class NavigationPolicy(Policy[NavigationPolicyState]):
    """Co-Wizard whose physical actions are chosen by a driver of `Navigation-v0`.

    The driver receives the observations of that environment. The rules of the scripted Co-Wizard interpret the
    utterances, talk, and send belief updates. Cruise speed and lights, which `Navigation-v0` leaves out, are
    set as the participant requests.
    """

    def __init__(
        self,
        choose: Choose,
        limits: SpaceLimits | None = None,
        *,
        max_seconds: float = MAX_SECONDS,
        decision_frequency: float = DECISION_FREQUENCY,
    ) -> None:
        """Prepares the policy.

        Args:
            choose: the driver.
            limits: sizes of the spaces.
            max_seconds: time limit of the sessions that the driver was trained in [s].
            decision_frequency: driving decisions per second in training [Hz].
        """
        super().__init__(Role.CO_WIZARD, limits)
        self._choose, self._max_seconds, self._interval = choose, max_seconds, 1.0 / decision_frequency
        self._scripted = ScriptedCoWizard(limits, PLAIN_STYLE)
        self._inputs: dict[Town, DriverInputs] = {}

    def initial_state(self, seed: int, town: Town) -> NavigationPolicyState:
        """Returns the state at the start of a session."""
        co_wizard = self._scripted.initial_state(seed, town)
        return NavigationPolicyState(co_wizard=co_wizard, speed=co_wizard.intentions.speed)

    def step(
        self, observation: ObservationMapping, state: NavigationPolicyState
    ) -> tuple[ActionDict, NavigationPolicyState]:
        """Processes utterances and observation, drives, and possibly speaks."""
        decision = attend(observation, state.co_wizard)
        inputs = self._inputs_of(decision.state.town)
        updated = inputs.update(state, decision.state, decision.view, dict(observation))
        physical, now = None, decision.view.time
        if now - updated.decided_at > self._interval - _EPSILON:
            updated = replace(updated, decided_at=now)
            physical = self._drive(inputs, updated)
            if physical is None:
                physical, updated = _set_speed_and_lights(updated, decision.view)
        return respond(decision, physical).encode(self.limits), updated

    def _drive(self, inputs: DriverInputs, state: NavigationPolicyState) -> Physical | None:
        if has_nothing_to_do(state):
            return None
        action = NavigationAction(self._choose(*inputs.observe(state)))
        return physical_of(action, driver_of(state.seen, inputs.exits))

    def _inputs_of(self, town: Town) -> DriverInputs:
        """Returns the conversion for a town; each is made once."""
        if town not in self._inputs:
            self._inputs[town] = DriverInputs(town, self._max_seconds)
        return self._inputs[town]


def _set_speed_and_lights(
    state: NavigationPolicyState, view: CoWizardView
) -> tuple[Physical | None, NavigationPolicyState]:
    """Sets cruise speed and lights once, as the participant requested; afterwards the driver controls them."""
    wanted = state.co_wizard.intentions
    if wanted.speed != state.speed:
        if abs(view.cruise - wanted.speed) > CRUISE_TOLERANCE:
            return Physical(action=PhysicalAction.SPEED_CHANGE, up=view.cruise < wanted.speed), state
        state = replace(state, speed=wanted.speed)
    if wanted.lights is not None and wanted.lights is not view.lights:
        return Physical(action=PhysicalAction.LIGHT_CHANGE, up=wanted.lights), state
    return None, state
