"""What a driver is told to do, from what the scripted Co-Wizard has made of the talk."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from dorothie_gym.maps import LinkType
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, PhysicalAction, StreetName
from dorothie_gym.policies.co_wizard.driving import PASSED, distance_ahead, wanted_exit
from dorothie_gym.policies.co_wizard.state import CoWizardState, Wish
from dorothie_gym.policies.co_wizard.understanding_update import NUDGE
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.navigation.instructor import AGAIN, TELL_DISTANCE, GuidanceStep, NavigationInstruction
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, nearest_sector
from dorothie_gym.policies.navigation.observation_vector import HeardInstruction
from dorothie_gym.policies.route_progress import stopping_distance
from dorothie_gym.spaces import Motion

AT_PLACE = 3.0
"""A car that stands this close to where it wanted to stop has come there, as far as it can tell [m]."""

WENT_ON = NUDGE / 2
"""A car that was to go a bit further has done so when it stands this close to where that ends [m]."""


@dataclass(frozen=True, kw_only=True)
class InstructionState:
    """What the driver remembers of what it was told.

    Attributes:
        heard: the same as the driver observes it.
        key: what tells the last instruction apart from others.
    """

    heard: HeardInstruction = field(default_factory=HeardInstruction)
    key: tuple[object, ...] = ()

    def renewed(self, mind: CoWizardState, view: CoWizardView, ways: JunctionExits) -> InstructionState:
        """The same after another decision: told something new, or the same again after a while."""
        step = next_step(mind, view, ways)
        if step is None:
            return replace(self, heard=replace(self.heard, goal=None))
        goal = goal_of(mind) if step.key[0] == "goal" else None
        told = self.heard.told
        if told is not None and step.key == self.key and view.time - told.time < AGAIN:
            return replace(self, heard=replace(self.heard, goal=goal))
        act = DialogueAct.of(DialogueMove.INSTRUCT, *step.values)
        told = NavigationInstruction(act=act, sector=step.sector, distance=step.distance, time=view.time)
        return InstructionState(heard=HeardInstruction(told=told, goal=goal), key=step.key)


def goal_of(mind: CoWizardState) -> Place | None:
    """Where the car is to find its own way to: a place on its map, or close to where one was said to be."""
    if mind.exact and mind.place is not None:
        return mind.place
    return mind.journey.goal if mind.journey is not None else None


def next_step(mind: CoWizardState, view: CoWizardView, ways: JunctionExits) -> GuidanceStep | None:
    """What is to be done now; None where nothing more is than has been told.

    It is what the participant of `Navigation-v0` would say: turns shortly before they are due, places by name, Stop
    with the distance to where the car is to stand.
    """
    stopped = view.motion is Motion.STOPPED and view.standing
    if mind.halted:
        return GuidanceStep(("stop",), (ActionValue.STOP,), None, stopping_distance(view.speed))
    if mind.nudge is not None:
        left = max(distance_ahead(mind, view, mind.nudge) or 0.0, 0.0)
        action = ActionValue.START if stopped else ActionValue.STOP
        return GuidanceStep((action, mind.nudge), (action,), None, left)
    if mind.wish is not None:
        return _manoeuvre(mind, view, mind.wish)
    if mind.directive is not None or goal_of(mind) is None:
        turn = _turn(mind, view, ways)
        if turn is not None:
            return turn
    goal = goal_of(mind)
    if goal is not None:
        return GuidanceStep(("goal", goal), (mind.goal if mind.goal is not None else LandmarkName.UNKNOWN,))
    return GuidanceStep(("on",), (ActionValue.START,)) if stopped else None


def _manoeuvre(mind: CoWizardState, view: CoWizardView, wish: Wish) -> GuidanceStep:
    """A lane switch or a U-turn; the latter begins on the leftmost lane."""
    leftmost = mind.town.neighbour(view.lane, LinkType.LANE_CHANGE_LEFT) is None
    if wish is Wish.U_TURN and leftmost:
        return GuidanceStep(("round", view.lane), (ActionValue.U_TURN,))
    left = wish is not Wish.SWITCH_RIGHT
    return GuidanceStep(("lane", view.lane, left), (ActionValue.LANE_SWITCH,), nearest_sector(90.0 if left else -90.0))


def _turn(mind: CoWizardState, view: CoWizardView, ways: JunctionExits) -> GuidanceStep | None:
    """The turn that was asked for, at the next junction."""
    choice, way = view.choice, wanted_exit(mind, view)
    if choice is None or way is None or choice.distance > TELL_DISTANCE:
        return None
    street = mind.directive.street if mind.directive is not None else StreetName.UNKNOWN
    values = (ActionValue.J_TURN, street) if street is not StreetName.UNKNOWN else (ActionValue.J_TURN,)
    sector = ways.sector_of(choice.lane, way.connector)
    return GuidanceStep(("turn", choice.lane, way.connector), values, sector, choice.distance)


def note_deeds(mind: CoWizardState, view: CoWizardView) -> None:
    """Brings up to date what the car was to do, from what it is doing, whoever made it do so."""
    if mind.wish is Wish.U_TURN and view.manoeuvre is PhysicalAction.U_TURN:
        mind.wish = None
    elif mind.wish in (Wish.SWITCH_LEFT, Wish.SWITCH_RIGHT) and view.manoeuvre is PhysicalAction.LANE_SWITCH:
        mind.wish = None
    place = mind.nudge or (mind.place if mind.exact else None)
    if place is None or mind.halted:
        return
    left = distance_ahead(mind, view, place)
    stands = view.standing and view.motion is Motion.STOPPED
    near = AT_PLACE if mind.nudge is None else WENT_ON
    if stands and left is not None and abs(left) <= near:
        mind.halted, mind.nudge, mind.arrived = True, None, mind.goal is not None
        mind.stop_sent_at = view.time
    elif mind.nudge is not None and (left is None or left < -PASSED):
        mind.nudge = None
