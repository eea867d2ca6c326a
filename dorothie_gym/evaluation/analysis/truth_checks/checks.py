"""Figures of the content of a corpus: shares of the cases that the recordings can decide, with their numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.propositions import ASKED, Predicate, Proposition
from dorothie_gym.evaluation.analysis.exception_attribution import kind_of, times_mentioned
from dorothie_gym.evaluation.analysis.truth_checks import (
    laps,
    mention_checks,
    order_checks,
    passenger_checks,
    repair_runs,
    reply_checks,
    sense_checks,
)
from dorothie_gym.evaluation.analysis.truth_checks.directions import directions_of, manner_of
from dorothie_gym.evaluation.analysis.truth_checks.loops import has_loop
from dorothie_gym.evaluation.analysis.truth_checks.perceivable import perceived_at
from dorothie_gym.evaluation.analysis.truth_checks.session_world import SessionWorld
from dorothie_gym.evaluation.analysis.truth_checks.talk_cases import Case
from dorothie_gym.evaluation.analysis.truth_checks.truth import agrees, is_true
from dorothie_gym.evaluation.analysis.units import Units
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import LandmarkName, Slot
from dorothie_gym.session.recording.events import EventType, MoveRecord
from dorothie_gym.tasks.purposes import find_items, read_people

if TYPE_CHECKING:
    from dorothie_gym.archive.corpus import Corpus
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session

TALKED_ABOUT_WITHIN: Final = 45.0
"""Time within which an exception is talked about [s]."""

ANSWERED_WITHIN: Final = 10.0
"""Time within which an answer belongs to a question [s]."""

_FACTUAL: Final = frozenset(
    {
        DialogueMove.EXPLAIN,
        DialogueMove.REPLY_W,
        DialogueMove.REPLY_Y,
        DialogueMove.REPLY_N,
        DialogueMove.CONFIRM,
    }
)
_YES_NO: Final = frozenset({DialogueMove.REPLY_Y, DialogueMove.REPLY_N})
_ANSWERS: Final = _YES_NO | {DialogueMove.REPLY_W}
_QUESTIONS: Final = frozenset({DialogueMove.QUERY_YN, DialogueMove.QUERY_W, DialogueMove.CHECK})

SHARES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "truth": "statements that are true",
        "causes": "reasons that are right",
        "arrival_times": "arrival times within a factor of 1.5",
        "yes_no_answers": "yes and no that are right",
        "relevance": "answers to what was asked",
        "story": "sessions that mention somebody or something of the story",
        "loops": "sessions without an order given three times at one place, unremarked",
        "laps": "ways to a place without a stretch driven three times",
        "nudges": "small distances that are ordered at most twice while the car hardly moves",
        "unchanged_orders": "orders that are said at most twice in the same words at one place",
        "reversals": "orders that follow another one without contradicting it for no reason",
        "repair_lengths": "repairs that take at most four turns",
        "repair_wordings": "successive turns of a repair in other words",
        "repair_replies": "requests to repeat that are not met with another one",
        "answers_given": "questions that are answered",
        "answer_forms": "answers to open questions that are no bare yes or no",
        "refusals": "replies to requests that are no bare no",
        "arrival_claims": "claims of arrival that are true",
        "stale_remarks": "remarks on a repetition that has happened so often",
        "references": "houses and people named so that it is clear which is meant",
        "pronouns": "descriptions of people that do not call them it",
        "signs": "acknowledgements of the car that are made once",
        "orders_after_confirmation": "orders that are not given again right after they were confirmed",
        "own_doing": "questions why the car turns round that follow no order to do so",
        "arrivals_without_creeping": "guided arrivals with at most one order to drive on a little",
        "crowds": "remarks on traffic and crowds that are news",
        "ways_without_metres": "ways that the participant tells without metres",
        "obstacle_names": "obstacles called by the same name",
        "own_stops": "questions why the car stands that follow no order to stop",
        "destinations_asked_for": "questions where to go that were not answered just before",
        "directions_ahead": "directions with two or more steps",
        "directions_by_places": "directions that name a landmark or an object",
    }
)
"""Titles of the figures except those of the exceptions."""

_EXCEPTIONS: Final = "exceptions/"
_MANNERS: Final = "directions/"
_OF_MANNERS: Final[Mapping[str, str]] = MappingProxyType(
    {"ahead": "with two or more steps", "by_places": "that name a landmark or an object"}
)
"""Figures by manner of giving directions."""


@dataclass
class TalkChecks:
    """Counts of a corpus.

    Attributes:
        right: number of correct cases, by figure; exceptions as "exceptions/KIND".
        cases: number of cases that can be decided.
        unperceived: number of exceptions that no role could perceive, by kind.
        faults: passages at fault: session, figure, time [s] and words.
    """

    right: Counter[str] = field(default_factory=Counter)
    cases: Counter[str] = field(default_factory=Counter)
    unperceived: Counter[str] = field(default_factory=Counter)
    faults: list[dict[str, object]] = field(default_factory=list)

    def judge(self, figure: str, case: Case, session: str = "") -> None:
        """Counts the case of a passage, and keeps the passage if it is wrong."""
        self.add(figure, case.right)
        if not case.right:
            self.faults.append({"session": session, "figure": figure, "time": case.time, "words": case.words})

    def add(self, figure: str, right: bool | None) -> None:
        """Counts a case; None for one that the records cannot decide."""
        if right is not None:
            self.right[figure] += right
            self.cases[figure] += 1

    def share(self, figure: str) -> float | None:
        """Returns the share of right cases in [0, 1]; None without a case."""
        return self.right[figure] / self.cases[figure] if self.cases[figure] else None

    def rows(self) -> Iterator[tuple[str, float | None, int]]:
        """Yields title, share and number of cases of each figure."""
        for figure, title in SHARES.items():
            yield title, self.share(figure), self.cases[figure]
        for name in sorted(name for name in self.cases if name.startswith(_MANNERS)):
            manner, figure = name.removeprefix(_MANNERS).split("/")
            yield f"directions of the manner {manner} {_OF_MANNERS[figure]}", self.share(name), self.cases[name]
        for name in sorted(name for name in self.cases if name.startswith(_EXCEPTIONS)):
            kind = name.removeprefix(_EXCEPTIONS).replace("_", " ")
            yield f"exceptions talked about: {kind}", self.share(name), self.cases[name]

    def to_json(self) -> dict[str, object]:
        """Returns each share, and the number of its cases as `NAME_n`; exceptions by kind."""
        rows: dict[str, object] = {}
        for figure in SHARES:
            rows[figure], rows[f"{figure}_n"] = self.share(figure), self.cases[figure]
        for name in sorted(name for name in self.cases if name.startswith(_MANNERS)):
            rows[name], rows[f"{name}_n"] = self.share(name), self.cases[name]
        kinds = sorted(name.removeprefix(_EXCEPTIONS) for name in self.cases if name.startswith(_EXCEPTIONS))
        rows["exceptions"] = {kind: self.share(_EXCEPTIONS + kind) for kind in kinds}
        rows["exceptions_n"] = {kind: self.cases[_EXCEPTIONS + kind] for kind in kinds}
        rows["exceptions_unperceived_n"] = dict(sorted(self.unperceived.items()))
        rows["faults"] = self.faults
        return rows


def talk_checks_of(corpus: Corpus, on_session: Callable[[int, int], None] | None = None) -> TalkChecks:
    """Returns the figures of a corpus.

    Args:
        corpus: the corpus.
        on_session: called after each session with the number of sessions done and of all.
    """
    checks = TalkChecks()
    for number, entry in enumerate(corpus.entries, start=1):
        session = entry.load()
        check_session(checks, session, find_town(session.header.town, entry.maps), entry.name)
        if on_session is not None:
            on_session(number, len(corpus.entries))
    return checks


_PASSAGES: Final[Mapping[str, Callable[[Session], Iterator[Case]]]] = MappingProxyType(
    {
        "laps": laps.laps,
        "nudges": order_checks.nudges,
        "unchanged_orders": order_checks.unchanged,
        "reversals": order_checks.reversals,
        "repair_lengths": repair_runs.lengths,
        "repair_wordings": repair_runs.wordings,
        "repair_replies": repair_runs.replies_to_repairs,
        "answers_given": reply_checks.answers_given,
        "answer_forms": reply_checks.forms_of_answers,
        "refusals": reply_checks.refusals,
        "stale_remarks": mention_checks.stale_remarks,
        "references": mention_checks.references,
        "pronouns": mention_checks.pronouns,
        "obstacle_names": mention_checks.obstacle_names,
        "signs": sense_checks.signs,
        "orders_after_confirmation": sense_checks.orders_after_confirmation,
        "own_doing": sense_checks.own_doing,
        "arrivals_without_creeping": sense_checks.arrivals_without_creeping,
        "crowds": sense_checks.crowds,
        "ways_without_metres": passenger_checks.ways_without_metres,
        "own_stops": passenger_checks.own_stops,
        "destinations_asked_for": passenger_checks.destinations_asked_for,
    }
)
"""Checks of passages that need no map, by figure."""


def check_session(checks: TalkChecks, session: Session, town: Town | None, name: str = "") -> None:
    """Adds the cases of a session.

    Args:
        checks: counts.
        session: the session.
        town: its town; None if it is unknown, then only the cases that need no map count.
        name: name of the session, for the passages at fault.
    """
    world = SessionWorld(session, town) if town is not None and len(session.trajectory) else None
    if world is not None:
        _check_claims(checks, world)
    _check_answers(checks, session)
    _check_exceptions(checks, session, world)
    checks.add("story", mentions_story(session))
    checks.judge("loops", Case(not has_loop(session), 0.0, ""), name)
    for figure, check in _PASSAGES.items():
        for case in check(session):
            checks.judge(figure, case, name)
    for case in mention_checks.arrival_claims(world) if world is not None else ():
        checks.judge("arrival_claims", case, name)
    manner = manner_of(session)
    for direction in directions_of(session):
        checks.add("directions_ahead", direction.steps > 1)
        checks.add("directions_by_places", direction.names_place)
        if manner is not None:
            checks.add(f"{_MANNERS}{manner}/ahead", direction.steps > 1)
            checks.add(f"{_MANNERS}{manner}/by_places", direction.names_place)


def _check_claims(checks: TalkChecks, world: SessionWorld) -> None:
    """Compares statements with the world."""
    for move in world.session.moves():
        for said in move.meaning if move.act.move in _FACTUAL else ():
            right = is_true(world, said, move.start, move.speaker)
            if said.predicate is Predicate.BECAUSE:
                checks.add("causes", right)
            if said.predicate is Predicate.ARRIVES_IN:
                _check_time(checks, world, move, said)
            else:
                checks.add("truth", right)
            if move.act.move in _YES_NO:
                checks.add("yes_no_answers", right)


def _check_time(checks: TalkChecks, world: SessionWorld, move: MoveRecord, said: Proposition) -> None:
    place, seconds = said.get("place"), said.get("seconds")
    arrival = world.arrival(move.start, place) if isinstance(place, LandmarkName) else None
    if arrival is not None and isinstance(seconds, int):
        checks.add("arrival_times", agrees(seconds, arrival - move.start))


def _check_answers(checks: TalkChecks, session: Session) -> None:
    """Checks whether answers are about the question."""
    asked: MoveRecord | None = None
    for move in session.moves():
        if move.act.move in _QUESTIONS and move.meaning:
            asked = move
        elif asked is not None and move.speaker is not asked.speaker and move.act.move in _ANSWERS and move.meaning:
            if move.start - asked.end <= ANSWERED_WITHIN:
                checks.add("relevance", _is_about(move.meaning[0], _as_said(asked)))
            asked = None


def _as_said(asked: MoveRecord) -> Proposition:
    """Returns the proposition of a question, without a place that its words leave out: "is this it?"."""
    question = asked.meaning[0]
    named = question.get("place") in (None, *asked.act.values(Slot.LANDMARK))
    if named or question.predicate is not Predicate.ARRIVED:
        return question
    return Proposition.of(question.predicate, negated=question.negated)


def _is_about(answer: Proposition, question: Proposition) -> bool:
    """Returns whether the proposition of an answer is that of the question, completed or denied."""
    if answer.predicate is Predicate.BECAUSE:
        effect = answer.get("effect")
        if question.predicate is Predicate.BECAUSE:
            return effect == question.get("effect")
        return isinstance(effect, Proposition) and effect.predicate is question.predicate
    if answer.predicate is Predicate.GOAL and question.predicate in (Predicate.WILL, Predicate.TASK):
        return _is_open(question.get("action")) or _is_open(question.get("status"))  # "which way?" - "to KFC"
    if question.predicate is Predicate.ORDER:
        return answer.predicate is Predicate.ORDER  # either may be named first
    same = all(answer.get(name) in (None, value) for name, value in question.arguments if not _is_open(value))
    return answer.predicate is question.predicate and same


def _is_open(value: object) -> bool:
    return value is ASKED or getattr(value, "label", "") == "Queried"


def _check_exceptions(checks: TalkChecks, session: Session, world: SessionWorld | None) -> None:
    """Checks which exceptions that could be perceived are talked about in time; without a map, all count."""
    talked = times_mentioned(Units(session))
    for event in session.of_type(EventType.EXCEPTION):
        kind = kind_of(event)
        if kind is None or kind.name.startswith("DELETE") or event.data.get("on") is False:
            continue
        perceived = event.time if world is None else perceived_at(world, event)
        name = str(event.data.get("sensor") or event.data.get("weather") or kind.name.lower())
        in_time = perceived is not None and any(
            start - perceived <= TALKED_ABOUT_WITHIN for start in talked.get(id(event), ())
        )
        if perceived is None:
            checks.unperceived[name] += 1
        else:
            checks.add(_EXCEPTIONS + name, in_time)


def mentions_story(session: Session) -> bool | None:
    """Returns whether a speaker mentions a name or an item from the story; None if the story has neither."""
    texts = (session.header.story, *(str(row["description"]) for row in session.header.subgoals))
    things = (item for text in texts for item in find_items(text))
    wanted = {words.casefold() for words in (*read_people(*texts), *things)}
    if not wanted:
        return None
    said = " ".join(move.span for move in session.moves()).casefold()
    return any(re.search(rf"\b{re.escape(words)}\b", said) for words in wanted)
