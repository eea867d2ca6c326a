"""Parser of driving plans: the items of an utterance (`plan_items`) become the ordered steps that it asks for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from dorothie_gym.dialogue.clause_moods import ORDERED, ClauseMood, ClauseReader
from dorothie_gym.dialogue.numerals import read_ordinal
from dorothie_gym.dialogue.plan_frames import (
    FORBIDDING,
    NEEDING_PLACE,
    NEGATING,
    OVERTAKEN,
    PASSING,
    Frame,
    Refusal,
    append_step,
)
from dorothie_gym.dialogue.plan_items import (
    ActionItem,
    BoundaryItem,
    ConditionItem,
    ContingencyItem,
    DistanceItem,
    Item,
    LaneItem,
    NegationItem,
    NounPhrase,
    RepairItem,
    SideItem,
    SpeedItem,
    TurnItem,
    UnitItem,
    VerbItem,
    WordItem,
)
from dorothie_gym.dialogue.plan_leftovers import LeftoverReader
from dorothie_gym.dialogue.plan_opportunities import OpportunityReader
from dorothie_gym.dialogue.plan_places import PlaceReader, fetches
from dorothie_gym.dialogue.plan_repetitions import RepetitionReader
from dorothie_gym.dialogue.plan_speeds import SpeedReader
from dorothie_gym.dialogue.plan_turns import TurnReader
from dorothie_gym.dialogue.plan_waits import WaitReader
from dorothie_gym.dialogue.route_grammar import route_grammar
from dorothie_gym.dialogue.routes import (
    MAX_STEPS,
    Anaphor,
    ConditionRelation,
    DrivingPlan,
    PlaceReference,
    PlanStep,
    StepAction,
    StepChange,
)


class Sentence(NamedTuple):
    """Sentence as the parser reads it.

    Attributes:
        clauses: tokens, and the moods of their clauses.
        items: items of the chunker.
    """

    clauses: ClauseReader
    items: Sequence[Item]


@dataclass(frozen=True)
class PlanParse:
    """Result of the parser.

    Attributes:
        plan: steps that the driver is asked for.
        described: all steps that are named, also by questions and statements.
        moods: moods of the clauses, in order.
        repaired: whether the speaker replaced an own item.
        denied: actions that are named in negated form.
        aside: whether left or right is a side of the street.
        waiting: whether a condition, number or distance waits for its step: "at the lights".
        person: whether somebody is to be fetched.
        implied: actions of the plan that no word names.
        contingent: steps that are ordered in case of a condition of the world, and are no part of the plan.
        cancelled: whether errands are given up.
        conditional: whether there is a condition of the world.
        bare: whether the steps of the plan are names without a verb.
        turned: whether left and right, if there are any, name turns, rather than lanes and sides only.
        ceasing: whether a "stop" is no stop of the car, but the end of a doing: "stop braking".
        forbidding: whether the words only forbid something: "don't turn here", whose plan is to go on.
    """

    plan: DrivingPlan
    described: tuple[PlanStep, ...]
    moods: tuple[ClauseMood, ...]
    repaired: bool
    denied: frozenset[StepAction] = frozenset()
    aside: bool = False
    waiting: bool = False
    person: bool = False
    implied: frozenset[StepAction] = frozenset()
    forbidding: bool = False
    ceasing: bool = False
    contingent: tuple[PlanStep, ...] = ()
    conditional: bool = False
    cancelled: bool = False
    bare: bool = False
    turned: bool = False


_ACTIONS: Final = {
    "after_that": StepAction.VISIT,
    "faster": StepAction.SPEED,
    "slower": StepAction.SPEED,
    "leave": StepAction.TURN,
    "lights_on": StepAction.LIGHTS,
    "lights_off": StepAction.LIGHTS,
}
"""Actions of the kinds of the grammar that are not named for one."""
_CHANGES: Final = {
    "faster": StepChange.FASTER,
    "slower": StepChange.SLOWER,
    "lights_on": StepChange.ON,
    "lights_off": StepChange.OFF,
}
_HERE: Final = frozenset({"here", "here's"})
_TAKING: Final = frozenset({"take", "make", "turn"})
_AFTERWARDS: Final = frozenset({"after", "once"})
_IT: Final = frozenset({"it", "that", "them", "those"})
_TURNS: Final = frozenset({"turn", "turns", "turned", "turning", "turnings", "straight"})
_WAYS: Final = frozenset({"to", "down", "up", "on", "over", "along", "straight"})
_RANKING: Final = frozenset({"accept", "defer", "advance"})
"""Kinds of actions that order what has been named."""
_GOING: Final = (["we're"], ["i'm"])
_HEADING: Final = frozenset({"going", "heading", "off"})
_PLACING: Final = frozenset(
    {ConditionRelation.AT, ConditionRelation.BESIDE, ConditionRelation.OPPOSITE, ConditionRelation.BEFORE}
)
"""Relations that say more precisely where "there" is."""
_ROOM: Final = frozenset({"room", "space", "berth"})
_OVERTAKING: Final = frozenset({"past", "pass", "passing", "overtake", "overtaking", "leapfrog"})
"""Words of an action that gets past another vehicle; one gets round other things as well."""
_PAST: Final = frozenset({"shut", "went", "got", "closed", "ran", "came", "has", "looks"})


def parse_plan(sentences: Sequence[Sentence]) -> PlanParse:
    """Returns the plan of an utterance.

    Args:
        sentences: the sentences in order; conditions, places and corrections reach across them.
    """
    builder = _Builder()
    for sentence in sentences:
        builder.read(sentence)
    return builder.finish()


class _Builder(TurnReader, PlaceReader, OpportunityReader, SpeedReader, LeftoverReader, WaitReader, RepetitionReader):
    """Assembles steps from items."""

    def __init__(self) -> None:
        super().__init__()
        self.turned = False  # whether anything names a turn
        self.sided = False  # whether anything names a lane or a side

    def read(self, sentence: Sentence) -> None:
        """Reads a sentence; it begins a clause."""
        self.clauses = sentence.clauses
        self.close()
        self.begun, self.joint = len(self.frames), ","
        self.negation, self.correcting, self.contingent = None, False, False
        self._clause(0, new=True)
        self.turned = self.turned or not _TURNS.isdisjoint(sentence.clauses.words)
        for item in sentence.items:
            counted = self.counting
            self.turned = self.turned or isinstance(item, TurnItem)
            self.sided = self.sided or isinstance(item, SideItem | LaneItem)
            _RULES[type(item)](self, item)
            self.counting = self.counting and not counted

    def read_noun(self, item: NounPhrase) -> None:
        """Reads a place, or an opportunity to turn."""
        if item.reference is None:
            self.read_opportunity(item)
        else:
            self.read_place(item.reference)

    def _clause(self, place: int, *, new: bool) -> None:
        self.mood = self.clauses.mood(place, self.mood, new=new)
        self.moods.append(self.mood)

    def finish(self) -> PlanParse:
        """Returns the result."""
        self.close()
        pending = self.pending
        waiting = (pending.at, pending.ordinal, pending.distance) != (None, None, None)
        last = next((frame for frame in reversed(self.frames) if frame.action is not None), None)
        if last is not None and last.mood in ORDERED:
            open_place = last.at is None or self.is_vague(last)
            stops = last.action in (StepAction.STOP, StepAction.WAIT) and open_place and last is self.frames[-1]
            if self.joint == "and" and pending.relation is ConditionRelation.AFTER:
                pending.relation = ConditionRelation.AT  # "the Ikea, and after the KFC"
            if not (stops and self.joint in ("", ",")):  # not in "stop on the right, at the KFC"
                self.stop_between()
            if pending.at is not None and (last.at is None or (stops and pending.relation in _PLACING)):
                last.negated = last.negated and last.at is None  # "don't stop here, over there by the trees"
                self.attach(last, pending.relation or ConditionRelation.AT, pending.at)
            last.distance = last.distance or pending.distance
        self.read_leftovers()
        described: list[PlanStep] = []
        ordered: list[PlanStep] = []
        contingent: list[PlanStep] = []
        self.drop_interjection()
        self.start_ahead()
        self.drop_denied_name()
        self.drop_repeated()
        self.inherit_directions()
        for frame in sorted(self.frames, key=lambda frame: frame.deferred):
            for step in self.steps_of(frame):
                described.append(step)
                if frame.mood in ORDERED:
                    named = bool(frame.word or frame.verb in _TAKING) and step.action is StepAction.TURN
                    named = named or frame.joint == "then"
                    append_step(contingent if frame.contingent else ordered, step, named=named)
        replaced = {frame.replaces for frame in self.frames if frame.replaces is not None and frame.action is not None}
        return PlanParse(
            plan=DrivingPlan(tuple(ordered[:MAX_STEPS])),
            described=tuple(described),
            contingent=tuple(contingent),
            conditional=self.conditional,
            cancelled=bool(self.cancelled),
            moods=tuple(self.moods),
            repaired=self.repaired,
            denied=frozenset(self.denied | replaced),
            aside=self.aside,
            waiting=waiting,
            person=self.person,
            forbidding=self.forbidding,
            ceasing=self.ceasing,
            turned=self.turned or not self.sided,
            bare=all(frame.bare for frame in self.frames if frame.action is not None and frame.mood in ORDERED),
            implied=frozenset(
                frame.action
                for frame in self.frames
                if (frame.implied or frame.replaces is not None) and frame.action is not None
            ),
        )

    def _boundary(self, item: BoundaryItem) -> None:
        self.fresh = True
        self.joint = item.kind if self.joint in ("", ",") else self.joint
        self.negation, self.preceded = None, False
        if item.kind == "then":
            self.stop_between()
            self.end_stretch()
            self.close()
        before = self.mood
        self._clause(item.place, new=False)
        following = self.clauses.words[item.place : item.place + 3]
        leads = following[:1] in _GOING and not _HEADING.isdisjoint(following)  # "then we're all going to the KFC"
        if item.kind == "then" and before in ORDERED and (leads or self.clauses.names_next(item.place)):
            self.mood = self.moods[-1] = ClauseMood.COMMAND  # "pick up Tom, and after that it's the Coco"

    def _contingency(self, item: ContingencyItem) -> None:
        """Lets what depends on a condition of the world wait: what follows, or what has been said in this sentence."""
        self.conditional = True
        if not item.leading:
            for frame in self.frames[self.begun :]:
                frame.contingent = frame.contingent or frame.action not in (StepAction.WAIT, StepAction.GO)
            return
        self.moods.pop()
        self.close()
        self.contingent = True
        self._clause(item.place, new=False)

    def _repair(self, item: RepairItem) -> None:
        last = next((frame for frame in reversed(self.frames) if frame.action is not None), None)
        said = self.clauses.words[max(item.place - 2, 0) : item.place]
        if last is not None and last.action is StepAction.TURN and last.mood is ClauseMood.STATEMENT:
            if said and said[0] in PASSING:  # "there's a right coming up, ignore that"
                self.refused = Refusal(last.direction, last.ordinal)
                self._boundary(BoundaryItem("and", item.place))
                return
        self.correcting = True
        if any(frame.action is not None for frame in self.frames):
            self.repairing = True
        self._boundary(BoundaryItem("and", item.place))

    def _negate(self, item: NegationItem) -> None:
        if item.kind == "cancel" and self.frame is not None and not self.fresh and self.frame.action is None:
            self.frame.verb = ""  # "let's skip the KFC"
        self.negation, self.ceasing = item.kind, self.ceasing or item.kind == "cease"
        last = next((frame for frame in reversed(self.frames) if frame.action is not None), None)
        told = last is not None and last.action is StepAction.TURN and last.mood is ClauseMood.STATEMENT
        if item.kind == "cancel" and told and last is not None:
            self.refused = Refusal(last.direction, last.ordinal)  # "there's a left coming up, skip that"

    def _verb(self, item: VerbItem) -> None:
        said = self.frame is not None and not self.fresh and self.frame.action is StepAction.VISIT
        if said and self.frame is not None and self.frame.place is not None and self._ends(item.end):
            return  # "off to the Shell we go"
        if self.frame is None or self.fresh or self.frame.action is not None:
            frame = self.open_step(None)
            frame.verb = item.word
            before = self.clauses.words[item.end - 2] if item.end > 1 else ""
            frame.ends = self._ends(item.end) and before not in ("to", "another", "a")
        elif not self.frame.verb:
            self.frame.verb = item.word

    def _action(self, item: ActionItem) -> None:
        if item.kind in _RANKING:
            self._rank(item.kind, self.clauses.words[item.place : item.end])
            return
        if item.kind == "after_that" or self._follows_errand(item):
            self.defer_last()
        action = _ACTIONS.get(item.kind) or StepAction(item.kind)
        change = _CHANGES.get(item.kind)
        if action is StepAction.GO and not self._ends(item.end):
            self._verb(VerbItem("go", item.end))  # "let's go round the block"
            return
        if action is StepAction.SPEED and change is not None:
            self.read_change(change, item)
            return
        named = self.frame is not None and self.frame.bare and not self.fresh
        if self._goes_on_to(action, item) or (action is StepAction.GO and named):
            return
        if action is StepAction.AVOID and named and self.frame is not None and self.frame.place is not None:
            self.frame.action, self.frame.mood, self.frame.bare = action, ClauseMood.COMMAND, False
            return  # "Hubbard is best avoided"
        if self.repairing:
            self.drop_last()
        frame = self.frame
        if frame is None or self._is_complete(frame, action):
            frame = self.open_step(action)
        elif frame.action in NEEDING_PLACE and action is StepAction.FOLLOW and self.negation is None:
            action = frame.action if frame.action is not None and frame.word != "to" else action
        self._begin(frame, action, item)

    def _rank(self, kind: str, words: Sequence[str]) -> None:
        """Accepts what has been named, or puts it first or last."""
        if kind == "accept":
            self._accept()
            if words[-1] in ("us", "me") and not any(frame.action is StepAction.STOP for frame in self.frames):
                self.open_step(StepAction.STOP)  # "second on the right and that's us"
        elif kind == "defer":
            self.defer_last()
        else:
            self.advance_last()

    def _begin(self, frame: Frame, action: StepAction, item: ActionItem) -> None:
        """Gives a step its action, with what the words of the action tell beside it."""
        frame.action, frame.word, frame.last = action, self.clauses.words[item.place], self.clauses.words[item.end - 1]
        self.open_action(frame)
        said = self.clauses.words[item.place : item.end]
        if action is StepAction.STRAIGHT and said[0] in PASSING and len(said) > 1:
            self.refused = Refusal(None, None)  # "ignore this turn"
        here = not _HERE.isdisjoint(said) or said[0] in ("this", "this'll")
        stays = action is StepAction.STOP or (action is StepAction.WAIT and "here" in said)
        if stays and frame.at is None and here:
            frame.relation, frame.at = ConditionRelation.AT, PlaceReference(reference=Anaphor.HERE)
        if self.negation in NEGATING:
            frame.negated, frame.forbidden = True, self.negation in FORBIDDING
        frame.change = _CHANGES.get(item.kind, frame.change)
        if action is StepAction.SPEED and said[-1] in _IT and frame.speed is None:
            frame.speed = self.last_speed
        if item.kind == "leave":
            frame.verb, frame.implied = "leave", True
        if action is StepAction.AVOID and not _ROOM.isdisjoint(said):
            frame.place = OVERTAKEN  # "give that bike more room"
        passing = "#object" in said and not _OVERTAKING.isdisjoint(said)
        if action is StepAction.LANE and frame.at is None and passing:
            frame.relation, frame.at = ConditionRelation.PAST, OVERTAKEN
        frame.ends = self._ends(item.end)

    def _goes_on_to(self, action: StepAction, item: ActionItem) -> bool:
        """Returns whether an action only tells how far a street is followed: "take Fuller (all the way) down to"."""
        frame, words = self.frame, self.clauses.words
        if frame is None or self.fresh or frame.action is not StepAction.FOLLOW or frame.place is None:
            return False
        following = words[item.end] if item.end < len(words) else ""
        if following in ("get", "reach", "go", "avoid", "be"):
            return False
        if action is StepAction.VISIT and words[item.end - 1] == "to" and words[item.place] in _WAYS:
            self.reaching = frame
            return True
        frame.bare = frame.bare and words[item.end - 1] != "end"  # "Fuller to the end, left"
        return words[item.place] in ("all", "down", "up", "to") and action in (StepAction.STRAIGHT, StepAction.FOLLOW)

    def _ends(self, place: int) -> bool:
        """Returns whether the clause ends at a token, apart from "now" and the like, or "it's" begins a new one."""
        words = self.clauses.words
        return place >= len(words) or words[place] in route_grammar().last_words or words[place] == "it's"

    def _is_complete(self, frame: Frame, action: StepAction) -> bool:
        """Returns whether another action begins a step of its own behind the current one."""
        if self.fresh:
            return True
        if frame.action is None and frame.verb and frame.relation is ConditionRelation.UNTIL:
            return action is not StepAction.STOP  # "go until the KFC turn left"
        if frame.action in (StepAction.GO, StepAction.U_TURN) and action is StepAction.VISIT:
            return False  # "let's go to the KFC"
        if frame.action is StepAction.STRAIGHT and action is StepAction.FOLLOW:
            return frame.at is not None or frame.distance is not None  # "go east along Bonisteel"
        return frame.action is not None and (frame.action not in NEEDING_PLACE or frame.place is not None)

    def _accept(self) -> None:
        """Orders what a statement has named: "there's a left coming up, take it"."""
        for frame in reversed(self.frames):
            if frame.mood is ClauseMood.STATEMENT and frame.action in (StepAction.TURN, StepAction.LANE):
                frame.mood = ClauseMood.COMMAND
                return
            if frame.mood is ClauseMood.STATEMENT and frame.place is not None and frame.action in NEEDING_PLACE:
                frame.mood = ClauseMood.COMMAND
                return
        self.take_last_place()

    def _follows_errand(self, item: ActionItem) -> bool:
        """Returns whether the errand said before comes after the next one: "the KFC, once we've been to the Shell"."""
        if item.kind != "visit" or self.clauses.words[item.place] not in _AFTERWARDS:
            return False
        before = self.clauses.words[item.place - 1] if item.place else "then"
        errands = (frame for frame in self.frames[self.begun :] if frame.action is StepAction.VISIT)
        return before not in ("then", "and") and any(frame.place is not None for frame in errands)

    def _word(self, item: WordItem) -> None:
        """Reads an unknown word; behind a bare place it makes a statement of it: "the KFC shut ages ago"."""
        self.preceded = self.preceded or item.word == "before"
        frame = self.frame
        speeding = frame is not None and frame.action is StepAction.SPEED and not self.fresh
        if frame is not None and speeding and item.word == "less":  # "ten miles an hour less"
            frame.speed, frame.change = None, StepChange.SLOWER
            return
        if frame is not None and speeding and item.word == "it" and frame.speed is None and frame.change is None:
            frame.speed = self.last_speed  # "the limit is thirty, stick to it"
            return
        if frame is not None and frame.last == "behind" and frame.action is StepAction.FOLLOW and item.word in _IT:
            frame.place = OVERTAKEN if frame.place is None else frame.place  # "stay behind it"
            return
        if frame is not None and frame.word in ("cross", "pass") and item.word in _IT and not self.fresh:
            if self.last_place is not None and frame.at is None:
                frame.relation, frame.at = ConditionRelation.PAST, self.last_place
            return
        if frame is not None and frame.action is StepAction.VISIT and frame.place is None and fetches(frame):
            if item.word in route_grammar().people and not self.fresh:
                self.fetch(frame)
            elif item.word not in route_grammar().modifiers and read_ordinal(item.word) is None:
                frame.word = ""  # things are collected, too
            return
        if frame is not None and frame.bare and not self.fresh and frame is self.frames[-1]:
            if item.word in route_grammar().finite or item.word in _PAST or item.word.endswith(("ed", "'s")):
                frame.mood, frame.bare = ClauseMood.STATEMENT, False


_RULES: Final[Mapping[type, Callable[[_Builder, Any], None]]] = {
    ActionItem: _Builder._action,
    VerbItem: _Builder._verb,
    TurnItem: _Builder.read_turn,
    LaneItem: _Builder.read_lane,
    SideItem: _Builder.read_side,
    ConditionItem: _Builder.read_condition,
    ContingencyItem: _Builder._contingency,
    NounPhrase: _Builder.read_noun,
    DistanceItem: _Builder.read_distance,
    SpeedItem: _Builder.read_speed,
    BoundaryItem: _Builder._boundary,
    RepairItem: _Builder._repair,
    NegationItem: _Builder._negate,
    UnitItem: _Builder.read_unit,
    WordItem: _Builder._word,
}
"""What is done with an item, by its class."""
