"""Details of an utterance that follow from its driving plan: named actions, turns, speeds and distances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Literal

from dorothie_gym.dialogue.clause_moods import ORDERED
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.directions import RouteTurn
from dorothie_gym.dialogue.routes import ConditionRelation, PlanStep, StepAction, StepChange
from dorothie_gym.ontology.slots import ActionValue

if TYPE_CHECKING:
    from dorothie_gym.dialogue.plan_parser import PlanParse

ACTION_VALUES: Final[Mapping[StepAction, ActionValue]] = MappingProxyType(
    {
        StepAction.TURN: ActionValue.J_TURN,
        StepAction.STRAIGHT: ActionValue.LANE_FOLLOW,
        StepAction.LANE: ActionValue.LANE_SWITCH,
        StepAction.U_TURN: ActionValue.U_TURN,
        StepAction.STOP: ActionValue.STOP,
        StepAction.WAIT: ActionValue.STOP,
        StepAction.GO: ActionValue.START,
        StepAction.SPEED: ActionValue.SPEED_CHANGE,
        StepAction.LIGHTS: ActionValue.LIGHT_CHANGE,
    }
)
"""Value of the slot `Action` of each step that is an action of the car; errands and streets have none."""

_WEAK: Final = frozenset({ActionValue.LANE_FOLLOW, ActionValue.START})
"""Actions that are read only where the words name no other."""

_ORDER: Final = {value: number for number, value in enumerate(ActionValue)}
_OPPOSITES: Final = frozenset({StepChange.FASTER, StepChange.SLOWER})
_DIRECTIONS: Final = {StepAction.STRAIGHT: Direction.STRAIGHT, StepAction.U_TURN: Direction.BACK}


def named_actions(actions: Sequence[ActionValue], parse: PlanParse) -> tuple[ActionValue, ...]:
    """Returns the actions that a text names: those of its words, corrected by the steps that were read.

    Args:
        actions: actions that the lexicon finds.
        parse: steps of the text.
    """
    steps = [step.action for step in parse.plan]
    asked = {*steps, *parse.denied} - (set(parse.implied) - {StepAction.STOP})
    read = {ACTION_VALUES[action] for action in asked if action in ACTION_VALUES}
    if ActionValue.U_TURN in read and ActionValue.J_TURN in actions and ActionValue.U_TURN not in actions:
        read = (read - {ActionValue.U_TURN}) | {ActionValue.J_TURN}  # "turn back at the junction"
    if any(step.change in _OPPOSITES for step in parse.plan):
        read |= {ActionValue.SPEED_CHANGE}  # "turn left slowly"
    turns = ActionValue.J_TURN in read or any(step.action is StepAction.TURN for step in parse.described)
    found = set(actions) - (set() if parse.turned else {ActionValue.J_TURN})
    only = bool(steps) and ORDERED.issuperset(parse.moods) and not {StepAction.FOLLOW, StepAction.STRAIGHT} & set(steps)
    if not turns and (only or parse.aside or ActionValue.LANE_SWITCH in read):
        found.discard(ActionValue.J_TURN)
    if steps and ORDERED.issuperset(parse.moods) and StepAction.FOLLOW not in steps and not parse.denied:
        found -= _WEAK - read  # "right again and back to where we started"
    if found and len(steps) < 2:
        read -= _WEAK
    if any(step.action is StepAction.FOLLOW and _ends_somewhere(step) for step in parse.plan):
        found.add(ActionValue.LANE_FOLLOW)  # "take Murfin as far as the bridge"
    if StepAction.LANE in steps and StepAction.TURN not in steps and not parse.denied:
        found.discard(ActionValue.J_TURN)  # "the right, the right lane"
    if parse.ceasing and StepAction.STOP not in {*steps, *parse.denied}:
        found.discard(ActionValue.STOP)  # "stop turning left"
    found |= read
    named = [value for value in actions if value in found]
    return (*named, *sorted(found.difference(named), key=_ORDER.__getitem__))


def _ends_somewhere(step: PlanStep) -> bool:
    return step.condition is not None and step.condition.relation is ConditionRelation.UNTIL


def planned_turns(turns: tuple[RouteTurn, ...], parse: PlanParse) -> tuple[RouteTurn, ...]:
    """Returns the turns of a text: those of its words, or those of the steps where words mislead."""
    read: list[RouteTurn] = []
    for step in parse.described:
        direction = step.direction if step.action is StepAction.TURN else _DIRECTIONS.get(step.action)
        if direction is not None:
            read.append(RouteTurn(direction=direction, ordinal=step.ordinal))
    sideways = sum(turn.direction in (Direction.LEFT, Direction.RIGHT) for turn in read)
    found = sum(turn.direction in (Direction.LEFT, Direction.RIGHT) for turn in turns)
    if parse.repaired or (parse.aside and not read) or sideways > found:
        return tuple(read)
    return turns


def planned_change(parse: PlanParse, faster: bool | None) -> bool | None:
    """Returns whether a speed is to grow, by the steps, or else by the words."""
    for step in (*parse.plan, *parse.described):
        if step.action is StepAction.SPEED and step.change is not None:
            return step.change is StepChange.FASTER
    return faster


def planned_number(parse: PlanParse, field: Literal["speed", "distance"], number: int | None) -> int | None:
    """Returns the speed [km/h] or the distance [m] of the first step that has one, or else of the words."""
    found = (getattr(step, field) for step in parse.described)
    if field == "distance" and any(step.speed is not None for step in parse.described):
        number = None  # "metres" of "metres per second"
    return next((value for value in found if value is not None), number)
