"""Acceptance of driving plans of the participant: taken over, confirmed, corrected, or refused with a reason."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.plan_frames import OVERTAKEN
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.dialogue.routes import (
    Anaphor,
    ConditionRelation,
    PlaceReference,
    PlanStep,
    StepAction,
    StepChange,
    StepCondition,
)
from dorothie_gym.maps.model import LinkType
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, Slot, StreetName
from dorothie_gym.policies.co_wizard.destinations import aim, known_landmark, seek_street, set_goal
from dorothie_gym.policies.co_wizard.drivable_steps import STOP_APART, counted_together, counts_junctions, turned_back
from dorothie_gym.policies.co_wizard.instructed_actions import limit_remark
from dorothie_gym.policies.co_wizard.plan_contents import told_plan
from dorothie_gym.policies.co_wizard.plan_memory import STEERING
from dorothie_gym.policies.co_wizard.plan_objections import object_to
from dorothie_gym.policies.co_wizard.plan_points import first_objection
from dorothie_gym.policies.co_wizard.repairs import check_goal, lacks_what_to_do, note_contradiction
from dorothie_gym.policies.plan_propositions import content_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, intend

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.heard_utterance import HeardUtterance

_GOES_ON: Final = re.compile(r"^(?:(?:okay|ok|yes|yeah|and|so|um|uh)[, ]+)*(?:then|after that|afterwards|next)\b", re.I)
"""Beginning of an utterance that goes on with the plan before."""

_ADDS: Final = re.compile(
    r"^(?:(?:oh|ah|okay|ok|yes|yeah|um|uh)[, ]+)*(?:and|also|plus)\b(?!.*\b(?:first|before|instead)\b)"
    r"|\b(?:after that|afterwards|after this|on (?:the|our|my) list|as well|too|in addition)[ ,.!]*"
    r"(?:please|thanks|mate|dear|love)?[.!]*$",
    re.I,
)
"""Utterance that adds an errand to those that are known: "oh and the KFC after that"."""

_SIDE_ALONE: Final = re.compile(
    r"^\W*(?:on|at|to) (?:the|your|my|our) (?:left|right)\W*(?:please|mate|dear|love)?\W*$", re.I
)
"""Side of the street, of a stop that was asked for before."""

_GO_AHEAD: Final = re.compile(r"^\W*(?:\w+\W+){0,4}?go ahead and\b", re.I)
"""Opening of an order that asks for nothing by itself."""

_REPAIRS: Final = re.compile(r"\b(not|no|nope|wrong|instead|sorry|meant?|rather|belay)\b", re.I)
"""Words of an utterance that corrects the one before."""

_REFUSES: Final = re.compile(r"\b(ignore|skip|leave|let)\b.*\b(one|next) after\b", re.I)
"""Words of an utterance that counts an opportunity from the one it refuses."""

_DRIVING: Final = STEERING | {StepAction.LANE, StepAction.U_TURN, StepAction.STOP, StepAction.VISIT, StepAction.WAIT}
"""Steps whose order matters."""

_ORDERING_MOVES: Final = frozenset(
    {DialogueMove.INSTRUCT, DialogueMove.REPLY_W, DialogueMove.CLARIFY, DialogueMove.EXPLAIN, DialogueMove.QUERY_YN}
)
"""Moves by which a plan may be stated."""

_ALWAYS: Final = frozenset({StepAction.AVOID, StepAction.WAIT, StepAction.FOLLOW})
"""Steps that no single order expresses."""

_PLAIN: Final = frozenset(
    {StepAction.SPEED, StepAction.LIGHTS, StepAction.STOP, StepAction.GO, StepAction.U_TURN, StepAction.TURN}
)
"""Steps that are accepted in the words of a single action."""

_SIGNS: Final = frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.IRRELEVANT})
"""Moves without an order."""

_DESCRIBING: Final = frozenset({DialogueMove.EXPLAIN, DialogueMove.REPLY_W, DialogueMove.CLARIFY})
"""Moves by which a place may be described."""

_STEERED: Final = {StepAction.TURN: ActionValue.J_TURN, StepAction.U_TURN: ActionValue.U_TURN}
"""Actions by steps that may lead away from the route of the car."""

_ONLY_HERE: Final = frozenset({Anaphor.HERE, Anaphor.THERE})
_PASSED: Final = StepCondition(relation=ConditionRelation.PAST, place=OVERTAKEN)
"""Condition of a change of lanes that only names what to overtake."""


def planned_acts(state: CoWizardState, heard: HeardUtterance) -> frozenset[int]:
    """Returns the numbers of the acts of an utterance that state a plan to be kept; empty without one.

    Single orders are no plans. Neither is what a participant says who guides the car to a place off its map: where the
    place is, how far it is, and onto which street to turn.
    """
    steps, none = heard.words.plan.steps, frozenset[int]()
    asks = any(act.move is DialogueMove.QUERY_W for act in heard.acts)
    if not steps or asks or state.dialogue.detour_asked_at is not None or _changes_tasks(heard.acts):
        return none
    ordering = frozenset(number for number, act in enumerate(heard.acts) if _orders(state, heard, number))
    referring = frozenset(number for number in range(len(heard.acts)) if not ordering and _refers(heard, number))
    ordering = ordering or referring
    acts = [heard.acts[number] for number in sorted(ordering)]
    repairs = _is_restated(heard) or corrected_step(state, heard) is not None or bool(referring)
    if not acts or not (repairs or _is_kept(state, heard, acts) or _is_indirect(heard, acts)):
        return none
    return ordering


def is_incomplete(state: CoWizardState, view: CoWizardView, heard: HeardUtterance) -> bool:
    """Returns whether an order was heard without what it asks for, and does not correct the last one: "the second"."""
    return lacks_what_to_do(state, view, heard) and corrected_step(state, heard) is None


def _orders(state: CoWizardState, heard: HeardUtterance, number: int) -> bool:
    """Returns whether an act of an utterance may state a plan."""
    act, steps = heard.acts[number], heard.words_of(number).plan.steps
    mistaken = act.move in _SIGNS and any(map(_has_to_wait, steps))  # too much content for a sign of hearing
    if not steps or not (mistaken or act.move in _ORDERING_MOVES):
        return False
    describes = act.move in _DESCRIBING and not act.values(Slot.ACTION)
    return not (describes and _is_guided(state))


def _refers(heard: HeardUtterance, number: int) -> bool:
    """Returns whether an act orders only what another one has named: "where's the KFC? I need to be there"."""
    act = heard.acts[number]
    return bool(heard.parts) and act.move is DialogueMove.INSTRUCT and not act.slots


def _is_guided(state: CoWizardState) -> bool:
    """Returns whether the car is being guided to a place that is not on its map."""
    return state.beliefs.goal is not None and not state.beliefs.exact


def _changes_tasks(acts: Sequence[DialogueAct]) -> bool:
    """Returns whether an utterance gives up, completes or postpones an errand."""
    return any(act.values(Slot.STATUS) for act in acts)


def _is_restated(heard: HeardUtterance) -> bool:
    """Returns whether one part of an utterance takes back what another has asked for: "left. No, the second left"."""
    said = tuple(step for part in heard.parts for step in part.plan)
    steps = heard.words.plan.steps
    refers = any(words.search(heard.words.text) is not None for words in (_REPAIRS, _REFUSES))
    return len(steps) < len(said) or (bool(said) and steps != said and refers)


def _is_indirect(heard: HeardUtterance, acts: Sequence[DialogueAct]) -> bool:
    """Returns whether no act is an order by its form: "it's getting dark, nobody can see us", "could you stop?"."""
    moves = {act.move for act in acts}
    if not moves <= {DialogueMove.QUERY_YN, DialogueMove.EXPLAIN} | _SIGNS:
        return False
    if DialogueMove.QUERY_YN in moves:
        return True
    errands = all(step.action is StepAction.VISIT for step in heard.words.plan.steps)
    return not (errands or any(act.values(Slot.ACTION) for act in acts))


def _is_kept(state: CoWizardState, heard: HeardUtterance, acts: Sequence[DialogueAct]) -> bool:
    """Returns whether a plan has an order, conditions or steps that a single order cannot express."""
    steps = heard.words.plan.steps
    visits = sum(step.action is StepAction.VISIT for step in steps)
    if _adds_errand(state, heard) or any(step.side is not None for step in steps):
        return True
    named = any(act.values(Slot.LANDMARK) for act in acts) and not any(act.values(Slot.ACTION) for act in acts)
    if named and visits <= 1 and not any(step.action in STEERING for step in steps):
        return False  # "the Ikea, over on Beal" names a destination
    if _is_guided(state) and len(steps) == 1 and _guides(steps[0]):
        return False
    if not _is_guided(state) and any(_needs_count(step, classified=heard.classified) for step in steps):
        return True
    if sum(step.action in _DRIVING for step in steps) > 1 or any(_has_to_wait(step) for step in steps):
        return True
    if any(step.action in _ALWAYS or _returns(step) for step in steps):
        return True
    under_way = bool(state.plan.steps) or state.intentions.directive is not None
    return under_way and steps[0].action in _DRIVING and _GOES_ON.match(heard.words.text) is not None


def _needs_count(step: PlanStep, *, classified: bool) -> bool:
    """Returns whether a step is due behind a distance, or at an opportunity of its own side that has to be counted."""
    if step.action is StepAction.STOP and step.distance is not None:
        return True
    counted = step.action is StepAction.TURN and step.direction is not None and (step.ordinal or 1) > 1
    return classified and counted


def _adds_errand(state: CoWizardState, heard: HeardUtterance) -> bool:
    """Returns whether an utterance adds an errand behind the one that the car is on: "and the KFC after that"."""
    goal, steps = state.beliefs.goal, heard.words.plan.steps
    if goal is None or goal is LandmarkName.UNKNOWN or state.intentions.arrived or not _ADDS.search(heard.words.text):
        return False
    return all(step.action is StepAction.VISIT and _landmark(step) not in (None, goal) for step in steps)


def _returns(step: PlanStep) -> bool:
    """Returns whether a step drives back to a place of the drive so far."""
    return step.place is not None and step.place.reference in (Anaphor.START, Anaphor.LAST_STOP)


def _landmark(step: PlanStep) -> LandmarkName | None:
    """Returns the landmark that a step visits; None where it names none."""
    return None if step.place is None else step.place.landmark


def _guides(step: PlanStep) -> bool:
    """Returns whether a step is one of those by which a car is guided: "straight on for sixty meters", "onto Beal"."""
    if step.distance is not None or step.action is StepAction.FOLLOW:
        return step.action is not StepAction.TURN
    place = None if step.condition is None else step.condition.place
    return step.action is StepAction.TURN and place is not None and place.street is not None


def _has_to_wait(step: PlanStep) -> bool:
    """Returns whether a step is due only at some point of the road."""
    at = step.condition
    next_one = (
        counts_junctions(step) and at is not None and at.place.ordinal == 1 and at.relation is ConditionRelation.AT
    )
    overtakes = step.action is StepAction.LANE and at == _PASSED
    if at is not None and at.place.reference not in _ONLY_HERE and not (next_one or overtakes):
        return True
    if step.action is StepAction.TURN and step.distance is not None:
        return True
    return step.action is StepAction.STRAIGHT and (step.ordinal or 1) > 1


def take_plan(state: CoWizardState, view: CoWizardView, heard: HeardUtterance, rng: np.random.Generator) -> None:
    """Takes over a plan and confirms it, or says what the map holds against it.

    Args:
        state: working copy of the state.
        view: observation.
        heard: the utterance that states the plan.
        rng: random generator of the decision.
    """
    steps = turned_back(_without_opening(heard))
    action = _STEERED.get(steps[0].action)
    leads_away = action is not None and note_contradiction(state, view, action, steps[0].direction, steps[0].ordinal)
    _take_over(state, view, heard, steps, rng)
    if leads_away:
        check_goal(state, view)


def _without_opening(heard: HeardUtterance) -> tuple[PlanStep, ...]:
    """Returns the steps of an utterance, where "go ahead and turn left" does not ask to go straight on first."""
    steps = heard.words.plan.steps
    first = steps[0]
    plain = all(detail is None for detail in (first.condition, first.ordinal, first.distance, first.place))
    opens = first.action in (StepAction.STRAIGHT, StepAction.GO) and plain
    return steps[1:] if opens and steps[1:] and _GO_AHEAD.match(heard.words.text) else steps


def _take_over(
    state: CoWizardState,
    view: CoWizardView,
    heard: HeardUtterance,
    steps: tuple[PlanStep, ...],
    rng: np.random.Generator,
) -> None:
    text = heard.words.text
    state.dialogue = state.dialogue.with_proposal(None).after_steering(view.time)
    corrected = corrected_step(state, heard)
    if corrected is not None:
        state.plan = state.plan.corrected(corrected)
        state.intentions = state.intentions.directed(None)
        _confirm(state, state.plan.steps)
        return
    if _adds_errand(state, heard):
        waiting = state.plan.steps or (
            PlanStep(action=StepAction.VISIT, place=PlaceReference(landmark=state.beliefs.goal)),
        )
        _begin(state, view, (*waiting, *steps))
        _confirm(state, (*waiting, *steps))
        return
    if len(steps) == 1 and steps[0].action is StepAction.VISIT and _landmark(steps[0]) is not None:
        _visit(state, view, steps[0], rng)
        return
    goes_on = _GOES_ON.match(text) is not None and (bool(state.plan.steps) or state.intentions.directive is not None)
    if goes_on:
        _continue(state, steps)
        return
    possible, refused = _without_lane(state, view, steps)
    if refused is not None:
        state.say(refused)
    if not possible:
        return
    possible = _visiting(state, view, counted_together(possible))
    found = first_objection(state, view, possible)
    if found is not None and _seeks_street(state, view, possible[found[0]]):
        found = None
    kept = possible if found is None else possible[: found[0]]
    _begin(state, view, kept)
    plain = len(kept) == 1 and not _has_to_wait(kept[0]) and kept[0].side is None and kept[0].distance is None
    if found is None and plain and kept[0].action in _PLAIN:
        _accept(state, view, kept[0])
        return
    if kept:
        _confirm(state, kept, joined=refused is not None)
    for speed in (step.speed for step in kept if step.speed is not None):
        state.say(*limit_remark(state, view, speed))
    if found is not None:
        object_to(state, view, found[1], possible[found[0]], joined=bool(kept))


def _continue(state: CoWizardState, steps: tuple[PlanStep, ...]) -> None:
    """Adds steps to the plan, behind a turn that a single order has asked for: "second left", "and then stop"."""
    ordered = _ordered_turn(state)
    if ordered is not None:
        state.intentions = state.intentions.directed(None)
    state.plan = state.plan.continued(steps if ordered is None else (ordered, *steps))
    _confirm(state, steps)


def _ordered_turn(state: CoWizardState) -> PlanStep | None:
    """Returns the turn that a single order has asked for, as a step; None without one, or with a plan."""
    ordered = state.intentions.directive
    if state.plan.steps or ordered is None or ordered.direction not in (Direction.LEFT, Direction.RIGHT):
        return None
    street = None if ordered.street is StreetName.UNKNOWN else PlaceReference(street=ordered.street)
    return PlanStep(
        action=StepAction.TURN,
        direction=ordered.direction,
        ordinal=ordered.skip + 1 if ordered.skip else None,
        condition=None if street is None else StepCondition(relation=ConditionRelation.AT, place=street),
    )


def _visit(state: CoWizardState, view: CoWizardView, step: PlanStep, rng: np.random.Generator) -> None:
    name = _landmark(step)
    if name is not None:
        state.plan = state.plan.dropped()
        set_goal(state, view, name, _streets(step), rng)


def _seeks_street(state: CoWizardState, view: CoWizardView, step: PlanStep) -> bool:
    """Plans a route to a street that is to be followed and does not cross the road ahead; returns whether it did."""
    if step.action is not StepAction.FOLLOW or step.place is None or step.place.street is None:
        return False
    return seek_street(state, view, step.place.street)


def _begin(state: CoWizardState, view: CoWizardView, steps: tuple[PlanStep, ...]) -> None:
    """Replaces the plan and whatever was intended for the one before."""
    state.plan = state.plan.taken(steps)
    if any(step.action in _DRIVING and step.action is not StepAction.WAIT for step in steps):
        moves = steps[0].action not in (StepAction.WAIT, StepAction.LIGHTS, StepAction.AVOID)
        intentions = state.intentions.without_manoeuvres().without_nudge()
        state.intentions = intentions.started() if moves and not _stops_here(steps[0]) else intentions
    if any(step.action in STEERING for step in steps) and not state.beliefs.exact:
        seeking = steps[0].action is StepAction.FOLLOW
        state.route = state.route if seeking else state.route.with_progress(None)
    elif steps and steps[0].action is StepAction.GO:
        state.intentions = state.intentions.started()
    visits = [step for step in steps if step.action is StepAction.VISIT]
    for name in filter(None, map(_landmark, visits[1:])):
        state.beliefs = state.beliefs.with_status(name, GoalStatus.PENDING)
    first = _landmark(visits[0]) if visits and visits[0] is steps[0] else None
    mark = None if first is None else known_landmark(state, view, first, _streets(visits[0]))
    if mark is not None:
        aim(state, view, mark)


def _stops_here(step: PlanStep) -> bool:
    return step.action is StepAction.STOP and step.condition is None and step.distance is None


def _streets(step: PlanStep) -> tuple[StreetName, ...]:
    return () if step.place is None or step.place.street is None else (step.place.street,)


def _visiting(state: CoWizardState, view: CoWizardView, steps: tuple[PlanStep, ...]) -> tuple[PlanStep, ...]:
    """Returns the steps with a visit in place of a first stop at a landmark that this road does not pass."""
    first = steps[0] if steps else None
    place = None if first is None or first.action is not StepAction.STOP or first.condition is None else first.condition
    if place is None or place.place.landmark is None or place.relation in STOP_APART:
        return steps
    found = first_objection(state, view, steps[:1])
    if found is None or found[1].landmark is None:
        return steps
    return PlanStep(action=StepAction.VISIT, place=place.place), *steps[1:]


def _without_lane(
    state: CoWizardState, view: CoWizardView, steps: tuple[PlanStep, ...]
) -> tuple[tuple[PlanStep, ...], Remark | None]:
    """Returns the steps without a change to a lane that is not there, and the remark about it."""
    first = steps[0]
    if first.action is not StepAction.LANE or first.condition not in (None, _PASSED) or first.distance is not None:
        return steps, None
    sides = {Direction.LEFT: LinkType.LANE_CHANGE_LEFT, Direction.RIGHT: LinkType.LANE_CHANGE_RIGHT}
    inwards = state.town.traffic.to_middle  # "change lanes"
    wanted = inwards if first.direction is None else sides.get(first.direction, inwards)
    if state.town.lanes[view.lane].in_junction or state.town.neighbour(view.lane, wanted) is not None:
        return steps, None
    none = Proposition.of(Predicate.POSSIBLE, action=ActionValue.LANE_SWITCH, direction=first.direction, negated=True)
    return steps[1:], intend(Function.INFORM, none, wording=Wording(topic="no_lane", direction=first.direction))


def _accept(state: CoWizardState, view: CoWizardView, step: PlanStep) -> None:
    """Accepts a single step by saying what is going to be done."""
    wording = Wording(
        topic="taken",
        direction=step.direction,
        faster=None if step.action is not StepAction.SPEED else _is_faster(view, step),
        lights=step.change is StepChange.ON if step.action is StepAction.LIGHTS else None,
        speed=step.speed,
    )
    state.say(intend(Function.ACCEPT, content_of(step), wording=wording))
    if step.speed is not None:
        state.say(*limit_remark(state, view, step.speed))


def _is_faster(view: CoWizardView, step: PlanStep) -> bool:
    return step.change is StepChange.FASTER if step.speed is None else step.speed >= view.cruise


def _confirm(state: CoWizardState, steps: Sequence[PlanStep], *, joined: bool = False) -> None:
    """Repeats a plan as it was understood."""
    state.say(told_plan(steps, Function.ACCEPT, joined=joined))


# --- corrections and single orders ------------------------------------------------------------------------------------


def corrected_step(state: CoWizardState, heard: HeardUtterance) -> PlanStep | None:
    """Returns the present step with the correction of an utterance; None if the utterance corrects nothing.

    A turn with another direction corrects the present turn if the words repair something: "not left, right".
    """
    present, steps = state.plan.present or _ordered_turn(state), heard.words.plan.steps
    if present is None or len(steps) != 1:
        return None
    if present.action is StepAction.STOP:
        sided = steps[0] == PlanStep(action=StepAction.STOP, side=steps[0].side)
        side = steps[0].side if sided else steps[0].direction
        if side is not None and (sided or _SIDE_ALONE.match(heard.words.text)):
            return replace(present, side=side)  # "stop at the KFC", "on the left"
    if {present.action, steps[0].action} != {StepAction.TURN}:
        return None
    repairs = any(act.move is DialogueMove.CLARIFY for act in heard.acts) or _REPAIRS.search(heard.words.text)
    if not repairs or _has_to_wait(steps[0]):
        return None
    if steps[0].direction is None and steps[0].ordinal is not None and heard.classified:
        return replace(present, ordinal=steps[0].ordinal)  # "sorry, the second"
    if steps[0].direction in (None, present.direction):
        return None
    return replace(present, direction=steps[0].direction, ordinal=steps[0].ordinal or present.ordinal)


def settle_with_order(state: CoWizardState, actions: Sequence[ActionValue], words: ParsedText) -> None:
    """Brings the plan into line with a single order.

    The turn that the present step asks for takes its place; another turn, or a turn back, replaces the plan.

    Args:
        state: working copy of the state.
        actions: actions of the order.
        words: its words.
    """
    step = state.plan.present
    turns = ActionValue.J_TURN in actions and words.direction in (Direction.LEFT, Direction.RIGHT)
    if step is None or not (turns or ActionValue.U_TURN in actions):
        return
    same = turns and step.action is StepAction.TURN and step.direction is words.direction
    state.plan = state.plan.advanced() if same else state.plan.dropped()
