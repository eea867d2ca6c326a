"""Mentions: stale remarks, claims of arrival, places and people that the words do not identify."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.evaluation.analysis.truth_checks.talk_cases import Case
from dorothie_gym.evaluation.analysis.truth_checks.truth import is_true
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass, Slot, StreetName
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.tasks.purposes import read_people

if TYPE_CHECKING:
    from dorothie_gym.dialogue.propositions import Proposition
    from dorothie_gym.evaluation.analysis.truth_checks.session_world import SessionWorld
    from dorothie_gym.session.recording.events import MoveRecord
    from dorothie_gym.session.recording.session import Session

PASSING: Final = 30.0
"""Distance from a place within which the car passes it [m]."""

SAME_OBSTACLE: Final = 30.0
"""Time for which an obstacle that the car names is taken for the one named before [s]."""

_OBSTACLE: Final = re.compile(
    r"\b(barrier|roadblock|barricade|cones?|dumpster|construction|skip|wreck|bin|trash can)\b", re.IGNORECASE
)
_ADDED: Final = "task_trigger"  # another errand is added to the list, the present one goes on
_AGAIN: Final = frozenset({Predicate.TRIED, Predicate.PASSED})
_SHARED: Final = frozenset({LandmarkName.HOUSE, LandmarkName.PERSON})
_NAMING: Final = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_W})
_IT: Final = re.compile(r"\b((?<!got )it|it's|its|that one|the one)\b", re.IGNORECASE)
_ABOUT_A_PLACE: Final = frozenset({Predicate.LOOKS, Predicate.LOCATED, Predicate.NEAR})
_ACTIONS: Final = {
    ActionValue.U_TURN: PhysicalAction.U_TURN,
    ActionValue.LANE_SWITCH: PhysicalAction.LANE_SWITCH,
    ActionValue.J_TURN: PhysicalAction.J_TURN,
}


def stale_remarks(session: Session) -> Iterator[Case]:
    """Yields the remarks that something has happened a number of times; wrong are those made before it has.

    An action counts if it was taken, or ordered and not taken, since the errand began; a place, if it was passed, or
    where none is named, if the car has been there before.
    """
    for move in session.moves():
        for said in move.meaning:
            times = said.get("times")
            if said.predicate in _AGAIN and isinstance(times, int):
                yield Case(_times(session, said, move) >= times, move.start, move.span)


def obstacle_names(session: Session) -> Iterator[Case]:
    """Yields what the car calls an obstacle that it has named just before; wrong is another name than before."""
    former, named_at = "", -math.inf
    for move in session.moves(Role.CO_WIZARD):
        found = _OBSTACLE.search(move.span) if ObjectClass.STATIC in move.act.slots else None
        if found is None:
            continue
        if move.start - named_at < SAME_OBSTACLE:
            yield Case(found[0].lower() == former, move.start, move.span)
        former, named_at = found[0].lower(), move.start


def _times(session: Session, said: Proposition, move: MoveRecord) -> float:
    changes = (event for event in session.of_type(EventType.SUBGOAL) if event.data.get("cause") != _ADDED)
    since = max((event.time for event in changes if event.time < move.start), default=0.0)
    place, action = said.get("place"), said.get("action")
    if said.predicate is Predicate.PASSED:
        return _passes(session, place, since, move.start) if isinstance(place, LandmarkName) else math.inf
    kinds = [action] if isinstance(action, ActionValue) else list(_ACTIONS)
    counts = [0 if isinstance(action, ActionValue) else _visits(session, since, move.start)]
    for kind in kinds:
        taken = [row for row in session.physical_actions if row.action is _ACTIONS.get(kind)]
        counts.append(sum(since <= row.frame / FRAME_RATE <= move.start for row in taken))
        ordered = (other for other in session.moves(Role.PARTICIPANT) if since <= other.end <= move.start)
        counts.append(sum(kind in other.act.slots for other in ordered))
    return max(counts)


def _visits(session: Session, since: float, until: float) -> int:
    """Returns how often the car has been where it is at the second time, since the first [s]."""
    part = _driven(session, since, until)
    return _approaches(part, float(part["x"][-1]), float(part["y"][-1])) if len(part) else 0


def _passes(session: Session, place: LandmarkName, since: float, until: float) -> float:
    """Returns how often the car came close to a place and left it again; infinity if its place is unknown."""
    part = _driven(session, since, until)
    counts = (_approaches(part, row["x"], row["y"]) for row in session.header.landmarks if row["name"] == place.label)
    return max(counts, default=math.inf) if len(session.trajectory) else math.inf


def _driven(session: Session, since: float, until: float) -> NDArray[np.void]:
    """Returns the rows of the trajectory between two times [s]."""
    rows = session.trajectory
    return rows[(rows["frame"] >= since * FRAME_RATE) & (rows["frame"] <= until * FRAME_RATE)]


def _approaches(rows: NDArray[np.void], x: float, y: float) -> int:
    """Returns how often the car came as close as `PASSING` to a point [m]."""
    close = np.hypot(rows["x"] - x, rows["y"] - y) <= PASSING
    return int(np.count_nonzero(close[1:] & ~close[:-1])) + int(close[:1].any())


def arrival_claims(world: SessionWorld) -> Iterator[Case]:
    """Yields the statements of the car that it has arrived; right are those that are true."""
    for move in world.session.moves(Role.CO_WIZARD):
        for said in move.meaning if move.act.move in (DialogueMove.EXPLAIN, DialogueMove.CLARIFY) else ():
            if said.predicate is Predicate.ARRIVED and not said.negated:
                right = is_true(world, said, move.start, move.speaker)
                if right is not None:
                    yield Case(right, move.start, move.span)


def references(session: Session) -> Iterator[Case]:
    """Yields destinations that the participant names of a kind of which the town has several.

    Changes of the list of errands ("that house later") do not count. Right are those whose words tell which one is
    meant: by a street on which there is one, or by a name.
    """
    people = read_people(session.header.story, *(str(row["description"]) for row in session.header.subgoals))
    names = {word.casefold() for name in people for word in name.split()}
    introduced: set[str] = set()
    for event in session.moves(Role.PARTICIPANT):
        kinds = [value for value in event.act.values(Slot.LANDMARK) if value in _SHARED]
        if not kinds or event.act.move not in _NAMING or event.act.values(Slot.STATUS):
            continue
        words = {word.removesuffix("'s") for word in re.findall(r"[a-z'-]+", event.span.casefold())}
        errand = f"{kinds[0].label} {_errands_done(session, event.start)}"
        if words & names:
            introduced.add(errand)
        several = len(_candidates(session, event)) > 1
        if several:
            yield Case(errand in introduced, event.start, event.span)


def _errands_done(session: Session, time: float) -> int:
    return sum(event.time < time for event in session.of_type(EventType.SUBGOAL))


def _candidates(session: Session, move: MoveRecord) -> list[object]:
    """Returns the landmarks that fit the kind and the street that a move names."""
    kinds = {value.label for value in move.act.values(Slot.LANDMARK)}
    streets = {value.label for value in move.act.values(Slot.STREET) if isinstance(value, StreetName)}
    names = session.header.street_names
    return [
        row
        for row in session.header.landmarks
        if row["name"] in kinds
        and (not streets or (0 <= row["street"] < len(names) and names[row["street"]] in streets))
    ]


def pronouns(session: Session) -> Iterator[Case]:
    """Yields the descriptions of people; wrong are those that call a person "it"."""
    for move in session.moves():
        about = [said for said in move.meaning if said.predicate in _ABOUT_A_PLACE]
        if any(said.get("place") is LandmarkName.PERSON for said in about):
            yield Case(_IT.search(move.span) is None, move.start, move.span)
