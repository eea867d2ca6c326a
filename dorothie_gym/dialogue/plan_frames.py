"""Steps under construction, and the state of the parser of driving plans."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from dorothie_gym.dialogue.clause_moods import ClauseMood, ClauseReader, is_participle
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.routes import (
    Anaphor,
    ConditionRelation,
    PlaceReference,
    PlanStep,
    StepAction,
    StepChange,
    StepCondition,
)
from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.slots import ObjectClass

if TYPE_CHECKING:
    from dorothie_gym.ontology.slots import LandmarkName, StreetName

NEEDING_PLACE: Final = frozenset({StepAction.FOLLOW, StepAction.VISIT, StepAction.AVOID})
"""Actions that need a place."""

TURNING: Final = frozenset({StepAction.TURN, StepAction.LANE, StepAction.U_TURN})
"""Actions with a direction."""

NEGATING: Final = frozenset({"forbid", "cease", "not", "instead"})
"""Kinds of negations of the grammar that negate the next step."""

FORBIDDING: Final = frozenset({"forbid", "cease"})
"""Kinds of negations that forbid it."""

REFUSING: Final = frozenset({*NEGATING, "cancel"})
"""Kinds of negations behind which an opportunity to turn is one that is not meant."""

PASSING: Final = frozenset({"pass", "ignore", "skip", "let"})
"""Words of actions by which turns are left alone."""

_AT_PLACES: Final = frozenset({StepAction.TURN, StepAction.STRAIGHT, StepAction.U_TURN, StepAction.SPEED})
"""Actions that are due at a place by which the words put them."""

_COUNTED: Final = frozenset({StepAction.TURN, StepAction.U_TURN, StepAction.STOP, StepAction.STRAIGHT})
"""Actions with an ordinal."""

_PLAIN_WAIT: Final = PlanStep(action=StepAction.WAIT)
OVERTAKEN: Final = PlaceReference(object=ObjectClass.VEHICLES)
"""Vehicle that is got past."""

_NEXT_JUNCTION: Final = PlaceReference(ordinal=1)
_MOVING_VERBS: Final = frozenset({"go", "head", "drive", "roll", "move", "keep", "proceed", "take"})
_STARTING: Final = frozenset({"go", "move", "drive"})
_PREPOSITIONS: Final = frozenset({"down", "along", "via", "up", "by"})


@dataclass
class Frame:
    """Step under construction: the fields of `PlanStep`, and what decides whether it becomes one.

    Attributes:
        relation: relation of its condition.
        at: place of its condition.
        mood: mood of its clause.
        negated: whether it is negated.
        forbidden: whether it is forbidden: "don't turn".
        verb: verb without a meaning of its own, "take".
        word: first word of its action.
        last: last word of its action.
        bare_number: number without a unit.
        bare: whether it is a name without a verb.
        borrowed: whether its condition comes from the clause before.
        ends: whether its clause ends behind the verb.
        deferred: whether it comes after the other errands.
        implied: whether its action is not named: "on the left, please".
        contingent: whether it depends on a condition of the world.
        joint: kind of the border before it: "then", "and" or ",", or "" without any.
        replaces: action that the words name and forbid, where the step is another one.
    """

    action: StepAction | None = None
    mood: ClauseMood = ClauseMood.COMMAND
    negated: bool = False
    forbidden: bool = False
    verb: str = ""
    direction: Direction | None = None
    ordinal: int | None = None
    distance: int | None = None
    relation: ConditionRelation | None = None
    at: PlaceReference | None = None
    side: Direction | None = None
    speed: int | None = None
    change: StepChange | None = None
    place: PlaceReference | None = None
    bare_number: int | None = None
    bare: bool = False
    borrowed: bool = False
    ends: bool = False
    word: str = ""
    last: str = ""
    deferred: bool = False
    implied: bool = False
    contingent: bool = False
    joint: str = ""
    replaces: StepAction | None = None

    @property
    def starts(self) -> bool:
        """Whether a verb of moving off stands alone, or only with its condition: "go until the lights let you"."""
        waits = self.relation is ConditionRelation.UNTIL or (self.ends and self.at is None)
        return self.action is None and self.verb in _STARTING and self.place is None and waits

    def step(self) -> PlanStep | None:
        """Returns the finished step; None without an action or with parts that do not fit together."""
        if self.action is None:
            return None
        ordinal = self.ordinal if self.action in _COUNTED else None
        condition = None
        if self.relation is not None and self.at is not None:
            condition = StepCondition(relation=self.relation, place=self.at)
        values: dict[str, Any] = {
            "direction": self.direction,
            "ordinal": ordinal,
            "distance": self.distance,
            "condition": condition,
            "side": self.side,
            "speed": self.speed,
            "change": self.change,
            "place": self.place,
        }
        try:
            return PlanStep(action=self.action, **values)
        except OntologyError:
            return None


class Refusal(NamedTuple):
    """Opportunity that is refused, by its direction and number; None where the words tell none."""

    direction: Direction | None
    ordinal: int | None


class PlanState:
    """State of the parser: finished steps, the step under construction, and what waits for one."""

    def __init__(self) -> None:
        """Begins without steps."""
        self.clauses = ClauseReader(words=(), question=False, contracted=frozenset())  # of the sentence
        self.frames: list[Frame] = []
        self.frame: Frame | None = None
        self.pending = Frame()  # parts that wait for their step
        self.begun = 0  # number of steps before the sentence
        self.moods: list[ClauseMood] = []
        self.mood = ClauseMood.COMMAND
        self.fresh = True  # whether a boundary stands behind the last item
        self.joint = ""  # kind of the last border
        self.repairing = False  # whether the next item replaces the last one
        self.repaired = False
        self.negation: str | None = None
        self.cancelled: set[LandmarkName] = set()
        self.denied: set[StepAction] = set()
        self.forbidding = False
        self.ceasing = False  # whether a "stop" ends a doing: "stop braking"
        self.contingent = False  # whether the rest of the sentence depends on a condition of the world
        self.conditional = False  # whether there has been such a condition
        self.counting = False  # whether the last item is an opportunity to turn
        self.refused: Refusal | None = None  # opportunity that is not meant: "not this left, the one after"
        self.preceded = False  # whether other errands come before the next one: "before we go to the KFC"
        self.opportunity = False  # whether a turning, a street or a junction has been mentioned
        self.last_place: PlaceReference | None = None
        self.aside = False  # whether left or right is a side of the street

    def close(self) -> None:
        """Finishes the step under construction."""
        if self.frame is not None:
            self._complete(self.frame)
        self.frame, self.fresh = None, True

    def _complete(self, frame: Frame) -> None:
        """Gives a step whose clause has ended the action that its parts tell."""
        moves = frame.verb == "go" or (frame.verb in _STARTING and frame.joint == "then")  # "wait, then drive"
        if frame.action is None and moves and frame.ends:
            frame.action = StepAction.GO
        if frame.negated and frame.forbidden and (frame.action is StepAction.GO or frame.starts):
            frame.action, frame.negated = StepAction.WAIT, False  # "don't go until the lights let you"
            frame.replaces = StepAction.GO
        if frame.action is StepAction.GO and (frame.distance is not None or frame.relation is ConditionRelation.UNTIL):
            frame.action = StepAction.STRAIGHT  # "drive on until you see the KFC"
        vague = frame.direction is None and frame.ordinal is None and frame.at is None and frame.distance is None
        if frame.action is StepAction.TURN and vague and not frame.ends and not frame.negated:
            frame.action = None  # "turn that song up"
        if frame.verb == "leave" and frame.action is StepAction.TURN and frame.at is None:
            frame.action = None
        if frame.action is None and frame.verb in _MOVING_VERBS:
            along = frame.at is not None and frame.relation in (ConditionRelation.PAST, ConditionRelation.UNTIL)
            frame.action = StepAction.STRAIGHT if along or frame.distance is not None else None
        if frame.action in NEEDING_PLACE and frame.place is None:
            self._complete_placeless(frame)

    def _complete_placeless(self, frame: Frame) -> None:
        """Gives another action to "follow" or "take me to" without the place to follow or visit."""
        measured = frame.distance is not None or (frame.at is not None and frame.word not in _PREPOSITIONS)
        if frame.action is StepAction.VISIT and frame.at is not None:
            frame.place, frame.at, frame.relation = frame.at, None, None
        elif frame.word in _PREPOSITIONS and frame.distance is not None:
            frame.action, self.pending.distance = None, frame.distance  # "half a mile down, turn left"
        elif frame.action is StepAction.FOLLOW and measured:
            frame.action = StepAction.STRAIGHT
        else:
            frame.action = None

    def open_step(self, action: StepAction | None) -> Frame:
        """Begins a step, which takes what has been waiting for one."""
        self.close()
        frame = Frame(action=action, mood=self.mood, negated=self.negation in NEGATING, joint=self.joint)
        self.joint = ""
        waiting, self.pending = self.pending, Frame()
        frame.forbidden, frame.contingent = self.negation in FORBIDDING, self.contingent
        if action is StepAction.TURN and self.negation == "cancel":  # "skip the next left"
            frame.negated = frame.forbidden = True
        elif self.negation == "cancel" and action in (StepAction.U_TURN, StepAction.LANE, StepAction.STOP):
            frame.negated = True  # "never mind the U-turn"
        frame.relation, frame.at, frame.distance = waiting.relation, waiting.at, waiting.distance
        frame.borrowed = waiting.at is not None
        frame.ordinal = waiting.ordinal
        frame.bare_number = waiting.bare_number
        if action in (StepAction.STOP, StepAction.WAIT):
            frame.side = waiting.side
        else:
            self.pending.side = waiting.side
        self.frames.append(frame)
        self.frame, self.fresh = frame, False
        if self.negation == "instead":
            self.negation = None
        return frame

    def replaced(self, *actions: StepAction) -> Frame | None:
        """Returns the last step of one of some kinds, if the speaker is about to replace it."""
        if not self.repairing:
            return None
        self.repairing = False
        for frame in reversed(self.frames):
            if frame.action is StepAction.WAIT and actions and StepAction.WAIT not in actions and frame.at is None:
                frame.action = None  # "the second, hang on, no, the third"
            if frame.action is not None:
                if not actions or frame.action in actions:
                    self.repaired = True
                    self.frame, self.fresh = frame, False
                    return frame
                return None
        return None

    def drop_last(self) -> None:
        """Withdraws the last step, which another one replaces."""
        self.repairing = False
        for number in range(len(self.frames) - 1, -1, -1):
            if self.frames[number].action is not None:
                del self.frames[number]
                self.frame, self.fresh, self.repaired = None, True, True
                return

    def drop_refused(self) -> None:
        """Takes back the step that refuses an opportunity, as the one that is meant has been named."""
        self.refused = None
        last = next((frame for frame in reversed(self.frames) if frame.action is not None), None)
        if last is None:
            return
        passed = last.action is StepAction.STRAIGHT and last.word in PASSING
        if passed or (last.action is StepAction.TURN and last.negated):
            last.action = None
            self.close()

    def follow_refused(self) -> bool:
        """Orders the opportunity behind one that is refused: "not this left, the one after"; returns whether one is."""
        refused = self.refused
        if refused is None or self.negation in REFUSING:
            return False
        self.drop_refused()
        current = self.frame if self.frame is not None and self.frame.action is None else None
        frame = self.open_step(StepAction.TURN) if current is None or self.fresh else current
        frame.action, frame.direction, frame.ordinal = StepAction.TURN, refused.direction, (refused.ordinal or 1) + 1
        return True

    def defer_last(self) -> None:
        """Puts the errand named last behind the others; without errands, the step named last."""
        acting = [frame for frame in self.frames if frame.action is not None]
        errands = [frame for frame in acting if frame.action is StepAction.VISIT]
        for frame in (errands or acting)[-1:]:
            frame.deferred, frame.mood = True, ClauseMood.COMMAND

    def advance_last(self) -> None:
        """Puts the errand named last in front of the others: "the Shell and the KFC, the KFC first"."""
        errands = [frame for frame in self.frames if frame.action is StepAction.VISIT]
        if len(errands) < 2:
            return
        last = errands[-1]
        for frame in errands[:-1]:
            if frame.place == last.place:
                frame.action = None  # it has been named before
            frame.deferred = True
        last.mood, last.deferred = errands[0].mood, False

    def open_action(self, frame: Frame) -> None:
        """Sets what the words in front of an action say of it: whether it waits, and whether it is told."""
        if frame.action is StepAction.VISIT:
            frame.deferred, self.preceded = frame.deferred or self.preceded, False
        first = frame is self.frames[0] and self.negation is None
        if self.mood is ClauseMood.COMMAND and first and is_participle(frame.word):
            frame.mood = ClauseMood.STATEMENT  # "now I am stopping", with the first words misheard

    def inherit_directions(self) -> None:
        """Gives a counted turn the direction of the negated one before it: "not the first left, the second"."""
        for before, frame in itertools.pairwise(self.frames):
            counted = frame.action is StepAction.TURN and frame.direction is None and frame.ordinal is not None
            if counted and before.action is StepAction.TURN and before.negated:
                frame.direction = before.direction
            if counted and before.action is StepAction.STRAIGHT and before.direction is not None:
                frame.direction, before.action = before.direction, None  # "ignore two lefts, take the third"
        for frame in self.frames:
            if frame.action is StepAction.STRAIGHT:
                frame.direction = None

    def steps_of(self, frame: Frame) -> list[PlanStep]:
        """Returns the step of a frame after its negation; empty if there is none."""
        if frame.negated and not self._negate_step(frame):
            return []
        if frame.action is StepAction.VISIT and frame.place is not None:
            left = frame.verb == "leave" and not frame.deferred
            if left or frame.place.landmark in self.cancelled:
                return []
        if frame.action is StepAction.SPEED:
            frame.distance = None
            frame.speed = frame.bare_number if frame.speed is None and frame.change is None else frame.speed
            if frame.speed is None and frame.change is None:
                return []
        self._settle_relation(frame)
        here = frame.at is not None and (frame.at.reference is Anaphor.THERE or frame.at == _NEXT_JUNCTION)
        if frame.action is StepAction.STRAIGHT and here and frame.relation is ConditionRelation.AT:
            frame.relation = frame.at = None
        passes = frame.relation in (ConditionRelation.PAST, ConditionRelation.AFTER) and frame.at is not None
        if frame.action is StepAction.TURN and frame.ordinal is not None and passes:
            if frame.at == PlaceReference(ordinal=max(frame.ordinal - 1, 1)) and frame.ordinal > 1:
                frame.relation = frame.at = None  # "past three streets, at the fourth, left"
        if frame.action in TURNING and frame.relation is ConditionRelation.UNTIL and frame.at is not None:
            stretch = Frame(action=StepAction.STRAIGHT, relation=frame.relation, at=frame.at)
            frame.relation = frame.at = None  # "up to the KFC, then right"
            steps = (stretch.step(), frame.step())
            if frame.action is StepAction.LANE:
                steps = steps[::-1]  # "keep to the right until the lights"
            return [step for step in steps if step is not None]
        other, relation = _other_errand(frame), frame.relation
        if other is not None:
            frame.relation = frame.at = None
        steps = (frame.step(), other) if relation is ConditionRelation.BEFORE else (other, frame.step())
        return [step for step in steps if step is not None]

    def _settle_relation(self, frame: Frame) -> None:
        """Puts the condition of a step into the form that its action has."""
        if frame.relation is ConditionRelation.BESIDE and frame.action in _AT_PLACES:
            frame.relation = ConditionRelation.AT  # "by the Shell, turn left"
        passed = frame.relation is ConditionRelation.PAST and frame.at == OVERTAKEN
        if frame.action is StepAction.LANE and frame.direction is not None and passed:
            frame.relation = frame.at = None  # "pass that bus on the left"

    def _avoids(self, frame: Frame) -> bool:
        """Makes a place that must not be passed one to avoid: "don't go over the bridge"; returns whether it did."""
        going = frame.action is StepAction.STRAIGHT and frame.at is not None
        passed = going and frame.relation is ConditionRelation.PAST
        street = frame.at is not None and frame.at.to_json().keys() == {"street"}
        turned = frame.action is StepAction.TURN and frame.direction is None and street
        alone = sum(other.action is not None for other in self.frames) == 1
        if not frame.forbidden or frame.at is None or not (turned or (passed and alone)):
            return False
        self.denied |= {StepAction.TURN} if turned else set()
        frame.action, frame.place, frame.at = StepAction.AVOID, frame.at, None
        return True

    def _negate_step(self, frame: Frame) -> bool:
        """Negates a step, such as a forbidden street to one to avoid; returns whether a step is left."""
        if self._avoids(frame):
            return True
        self.denied |= {frame.action} if frame.action is not None else set()
        if frame.action is StepAction.STOP and frame.relation is ConditionRelation.UNTIL and frame.at is not None:
            frame.relation = ConditionRelation.AT  # "don't stop until you are at the KFC"
            return True
        if frame.action is StepAction.STOP and frame.at is not None and frame.at.reference is None:
            frame.at = None  # "never stop on a bridge" says nothing of where to go on
        if frame.action in (StepAction.FOLLOW, StepAction.VISIT) and frame.place is not None:
            needless = frame.verb in ("need", "want") or frame.word in ("go", "head", "stop")
            if frame.action is StepAction.VISIT and frame.place.landmark is not None and needless:
                self.cancelled.add(frame.place.landmark)  # "we don't need the KFC any more"
            frame.action = StepAction.AVOID
            return frame.place.street is not None and frame.place.landmark is None
        if frame.action is StepAction.STOP or frame.action in TURNING:
            alone = sum(other.action is not None for other in self.frames) == 1
            frame.action, frame.direction, frame.ordinal = StepAction.STRAIGHT, None, None
            if frame.relation is ConditionRelation.BEFORE:
                frame.relation = ConditionRelation.UNTIL
            self.forbidding = self.forbidding or (alone and frame.forbidden)
            return alone and frame.forbidden
        if frame.action is StepAction.LIGHTS:
            frame.change = StepChange.OFF if frame.change is StepChange.ON else StepChange.ON
        return frame.action in (StepAction.SPEED, StepAction.LIGHTS)


def _other_errand(frame: Frame) -> PlanStep | None:
    """Returns the errand that comes before or after another one: "after the KFC we do the Shell"."""
    ordering = frame.relation in (ConditionRelation.AFTER, ConditionRelation.BEFORE)
    waits = frame.action is StepAction.VISIT and frame.borrowed and ordering
    if not waits or frame.at is None or frame.at.landmark is None or frame.place is None:
        return None
    return PlanStep(action=StepAction.VISIT, place=frame.at)


def append_step(steps: list[PlanStep], step: PlanStep, *, named: bool = False) -> None:
    """Adds a step, unless it only says the last one again; with more detail it replaces that one.

    Args:
        steps: the steps so far.
        step: the step.
        named: whether a verb names its action, so that a turn is no mere side of a lane.
    """
    if steps and {steps[-1].action, step.action} == {StepAction.SPEED}:
        speed, change = steps[-1].speed or step.speed, steps[-1].change or step.change
        told = (steps[-1].speed is None or step.speed is None) and steps[-1].change in (
            None,
            step.change or steps[-1].change,
        )
        if told and steps[-1].condition is None and step.condition is None:
            steps[-1] = PlanStep(action=StepAction.SPEED, speed=speed, change=change)
            return
    if steps and (steps[-1].action, step.action) == (StepAction.WAIT, StepAction.STOP) and steps[-1] == _PLAIN_WAIT:
        steps[-1] = step  # "hold it, stop"
        return
    if steps and step.action is StepAction.STOP and _ends_at(steps[-1], step):
        steps[-1] = step  # "go on to the wall and stop there"
        return
    if steps and {steps[-1].action, step.action} == {StepAction.LIGHTS} and steps[-1].condition == step.condition:
        steps[-1] = steps[-1] if not named else step  # "it's dark to be driving without lights"
        return
    if steps and not named and _is_side_of_lane(steps[-1], step):
        steps[-1] = step if step.action is StepAction.LANE else steps[-1]
        return
    if steps and steps[-1].action is step.action and step.action is not StepAction.TURN:
        old, new = _fields(steps[-1]), _fields(step)
        if old.items() <= new.items() or new.items() <= old.items():
            steps[-1] = step if len(new) > len(old) else steps[-1]
            return
    steps.append(step)


def _ends_at(stretch: PlanStep, stop: PlanStep) -> bool:
    """Returns whether a stretch straight on only leads to the place of a stop."""
    ends, at = stretch.condition, stop.condition
    if stretch.action is not StepAction.STRAIGHT or stretch.ordinal is not None or stretch.distance is not None:
        return False
    until = ends is not None and ends.relation is ConditionRelation.UNTIL
    return until and ends is not None and at is not None and at == dataclasses.replace(ends, relation=at.relation)


def _fields(step: PlanStep) -> dict[str, object]:
    """Returns what a step says; of a visited place each detail by itself: "pick her up, so my friend on Hubbard"."""
    fields: dict[str, object] = {**step.to_json()}
    if step.action is StepAction.VISIT and step.place is not None:
        del fields["place"]
        fields |= {f"place {name}": value for name, value in step.place.to_json().items()}
    return fields


def _is_side_of_lane(first: PlanStep, second: PlanStep) -> bool:
    """Returns whether two steps name the side of one lane: "the right, the right lane"."""
    if {first.action, second.action} != {StepAction.LANE, StepAction.TURN}:
        return False
    turn = first if first.action is StepAction.TURN else second
    return first.direction is second.direction and turn.to_json().keys() == {"action", "direction"}


def with_details(
    place: PlaceReference, *, side: Direction | None = None, street: StreetName | None = None
) -> PlaceReference:
    """Returns the place with a side of the street, or with its street."""
    return dataclasses.replace(place, side=side or place.side, street=street or place.street)
