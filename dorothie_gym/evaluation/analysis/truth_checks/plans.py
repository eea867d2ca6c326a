"""Truth of statements about tasks, destinations and plans, compared with later recorded events."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.tasks.purposes import in_first_person

if TYPE_CHECKING:
    from dorothie_gym.evaluation.analysis.truth_checks.session_world import SessionWorld

CARRIED_OUT_WITHIN: Final = 60.0
"""Time within which an announced action is carried out [s]."""

_JUST_DONE: Final = 6.0  # time before the words within which the action may already have been taken [s]
_STRAIGHT: Final = 30.0  # largest angle of a route that counts as straight [degrees]
_SHORTER: Final = 30.0  # largest unnoticed difference between two routes [m]

_COMMANDS: Final[Mapping[ActionValue, tuple[PhysicalAction, ...]]] = MappingProxyType(
    {
        ActionValue.J_TURN: (PhysicalAction.J_TURN,),
        ActionValue.U_TURN: (PhysicalAction.U_TURN,),
        ActionValue.LANE_SWITCH: (PhysicalAction.LANE_SWITCH,),
        ActionValue.SPEED_CHANGE: (PhysicalAction.SPEED_CHANGE,),
        ActionValue.LIGHT_CHANGE: (PhysicalAction.LIGHT_CHANGE,),
        ActionValue.STOP: (PhysicalAction.STOP,),
    }
)
"""Physical actions by which an announcement is carried out; following a lane needs none."""

BELIEF_DELAY: Final = 3.0
"""Time within which a belief update follows the words that state it [s]."""

_OPEN: Final = frozenset({GoalStatus.PENDING, GoalStatus.ONGOING})
_ARTICLE: Final = re.compile(r"^(an?|the|some|my|your|our) ")
_COUNTERMANDS: Final = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_N, DialogueMove.CLARIFY})


def is_carried_out(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Returns whether the car carries out an announced action; None after another order or the session's end."""
    value, direction = said.get("action"), said.get("direction")
    commands = _COMMANDS.get(value) if isinstance(value, ActionValue) else None
    if commands is None or speaker is not Role.CO_WIZARD:
        return None
    until = time + CARRIED_OUT_WITHIN
    for taken in world.session.physical_actions:
        when = taken.frame / FRAME_RATE
        fits = taken.action in commands and _goes(taken.angle, direction)
        if fits and time - _JUST_DONE <= when <= until:
            return True
    told = any(
        move.act.move in _COUNTERMANDS and time < move.end <= until for move in world.session.moves(Role.PARTICIPANT)
    )
    changed = any(time < event.time <= until for event in world.changes)
    over = len(world.session.trajectory) and world.session.trajectory["frame"][-1] < until * FRAME_RATE
    return None if told or changed or over else False


def _goes(angle: float | None, direction: object) -> bool:
    if angle is None or direction not in (Direction.LEFT, Direction.RIGHT):
        return True
    return angle > -_STRAIGHT if direction is Direction.LEFT else angle < _STRAIGHT


def is_goal(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Returns whether a place is one of the open tasks; without a place, whether one has been named.

    Statements of the Co-Wizard that agree with its recorded beliefs count as true: it may have misheard the place.
    It cannot be decided whether an open task is not the current one, nor which of several places with one name a
    street identifies.
    """
    place, own = said.get("place"), speaker is Role.CO_WIZARD
    if place is None:
        return world.goal_named(time) and not (own and world.believed_goal(time) is None)
    if not isinstance(place, LandmarkName):
        return False
    open_here = bool(_OPEN & set(world.statuses(time, place)))
    if own:
        believed = world.believed_goal(time + BELIEF_DELAY) is place
        return believed or (open_here and not said.negated)
    if said.negated and said.get("street") is not None and len(world.landmarks(place)) > 1:
        return None
    others = any(_OPEN & set(world.statuses(time, name)) for name in LandmarkName if name is not place)
    return None if open_here and others and said.negated else open_here


def has_status(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Returns whether the task at a place has a status: open ones may be called pending or ongoing."""
    place, status, count = (said.get(name) for name in ("place", "status", "count"))
    if isinstance(count, int) and status is GoalStatus.PENDING:
        errands = [value for name in LandmarkName for value in world.statuses(time, name)]
        return sum(value in _OPEN for value in errands) == count + 1  # besides the present one
    if not isinstance(place, LandmarkName) or not isinstance(status, GoalStatus):
        return None
    found = set(world.statuses(time, place))
    if status in _OPEN:
        return bool(found & _OPEN)
    return status in found if status in (GoalStatus.COMPLETE, GoalStatus.ABANDONED) else None


def is_nearer(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Returns whether the route to a place is shorter than that to another one."""
    ways = []
    for name in (said.get("place"), said.get("landmark")):
        rows = world.landmarks(name) if isinstance(name, LandmarkName) else []
        if len(rows) != 1:
            return None
        ways.append(world.way_to(time, rows[0]))
    return ways[0] <= ways[1] + _SHORTER


def has_purpose(world: SessionWorld, said: Proposition, time: float, speaker: Role) -> bool | None:
    """Returns whether story, tasks or messages name the person and the item that an errand is said to be about."""
    header = world.session.header
    texts = [header.story, *(str(row["description"]) for row in header.subgoals)]
    texts += [str(row["change"] or "") for row in header.subgoals]
    messages = world.session.of_type(EventType.MESSAGE)
    texts += [in_first_person(str(event.data.get("text"))) for event in messages if event.time <= time]
    known = " ".join(texts).casefold()
    named = [str(said.get(name)) for name in ("person", "item") if said.get(name) is not None]
    return all(_ARTICLE.sub("", _plain(words)) in _plain(known) for words in named) if named else None


def _plain(text: str) -> str:
    """Returns a text in lower case and without accents, which observed texts do not have."""
    return "".join(c for c in unicodedata.normalize("NFKD", text.casefold()) if not unicodedata.combining(c))


EVALUATORS: Final[Mapping[Predicate, Callable[[SessionWorld, Proposition, float, Role], bool | None]]] = (
    MappingProxyType(
        {
            Predicate.WILL: is_carried_out,
            Predicate.GOAL: is_goal,
            Predicate.TASK: has_status,
            Predicate.NEARER: is_nearer,
            Predicate.PURPOSE: has_purpose,
        }
    )
)
"""Evaluators of statements about tasks and plans, by predicate; see `truth.Evaluator`."""
