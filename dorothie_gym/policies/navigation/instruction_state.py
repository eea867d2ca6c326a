"""Present driving instruction, derived from the state of the scripted Co-Wizard after it has listened."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from dorothie_gym.maps import LinkType
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, PhysicalAction, StreetName
from dorothie_gym.policies.co_wizard.driving import distance_ahead, wanted_exit
from dorothie_gym.policies.co_wizard.state import CoWizardState, Wish
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.guidance_config import NUDGE_DISTANCE, GuidanceConfig
from dorothie_gym.policies.navigation.instructor import GuidanceStep, NavigationInstruction
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, nearest_sector
from dorothie_gym.policies.navigation.observation_vector import HeardInstruction
from dorothie_gym.policies.route_progress import stopping_distance
from dorothie_gym.spaces import Motion

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
    """Returns the place to which the car finds its own way: a place on its map, or its guess of one."""
    if state.beliefs.stop_place is not None:
        return state.beliefs.stop_place
    return state.route.progress.goal if state.route.progress is not None else None


def next_step(state: CoWizardState, view: CoWizardView, exits: JunctionExits) -> GuidanceStep | None:
    """Returns the step to carry out now; None where there is no other than those given already.

    It is the step that the instructor of `Navigation-v0` would give: turns shortly before they are due, destinations
    by name, Stop with the distance to where the car is to stand.
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
    """Returns a lane switch or a U-turn; a U-turn begins on the leftmost lane."""
    leftmost = state.town.neighbour(view.lane, LinkType.LANE_CHANGE_LEFT) is None
    if wish is Wish.U_TURN and leftmost:
        return GuidanceStep(("round", view.lane), (ActionValue.U_TURN,))
    left = wish is not Wish.SWITCH_RIGHT
    sector = nearest_sector(90.0 if left else -90.0)
    return GuidanceStep(("lane", view.lane, left), (ActionValue.LANE_SWITCH,), sector)


def _turn_step(state: CoWizardState, view: CoWizardView, exits: JunctionExits) -> GuidanceStep | None:
    """Returns the turn asked for at the next junction, once that is near."""
    choice, way = view.choice, wanted_exit(state, view)
    if choice is None or way is None or choice.distance > _GUIDANCE.turn_distance:
        return None
    directive = state.intentions.directive
    street = directive.street if directive is not None else StreetName.UNKNOWN
    values = (ActionValue.J_TURN, street) if street is not StreetName.UNKNOWN else (ActionValue.J_TURN,)
    sector = exits.sector_of(choice.lane, way.connector)
    return GuidanceStep(("turn", choice.lane, way.connector), values, sector, choice.distance)


def note_driving(state: CoWizardState, view: CoWizardView) -> None:
    """Updates the intentions of the Co-Wizard from what the car does, independently of the driver's commands.

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
        state.intentions = state.intentions.stopped_at_place(arrived=state.beliefs.goal is not None)
        state.commands = state.commands.after_stop(view.time)
    elif nudge is not None and (left is None or left < -state.config.passed):
        state.intentions = state.intentions.without_nudge()
