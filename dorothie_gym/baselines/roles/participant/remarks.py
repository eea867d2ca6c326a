"""Remarks of the learned participant: forms of the corpus without their names, and the sources of the names.

The forms are those of the learned Co-Wizard (`co_wizard.remarks`). Further sources are action and direction of the next
step on the route, those of the question that is answered, and texts of the story, such as the purpose of an errand; a
form keeps whether it is urgent.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from dorothie_gym.baselines.roles.learned_role import remark_forms
from dorothie_gym.baselines.roles.learned_role.remark_forms import TEXT_MARK
from dorothie_gym.baselines.roles.participant.memory import NotedEvent, SessionMemory
from dorothie_gym.baselines.roles.participant.records import next_step
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.maps.whereabouts import corner_of
from dorothie_gym.ontology.dialogue_acts import ORDERING_MOVES, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies.observation_parser import nearest_landmark, street_of
from dorothie_gym.policies.participant.order_wording import order
from dorothie_gym.policies.participant.route_steps import RouteStep, is_last_stretch
from dorothie_gym.policies.participant.stories import purpose_of_target
from dorothie_gym.policies.participant.target_hints import famous_nearby
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import first_new_street
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.view_range import sight, suitable_speed
from dorothie_gym.tasks.landmark_designs import features_of

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.learned_role.utterance_inputs import Utterance
    from dorothie_gym.policies.participant.view import ParticipantView

TEXTS: Final = ("person", "item", "purpose", "reason", "feature")
"""Arguments of propositions that are free texts."""

_SHORT, _SPOKEN = 1.0, 8.0
"""Distances by which spoken distances are shortened, when they are short and otherwise [m]."""


def sources(memory: SessionMemory, view: ParticipantView, utterances: Sequence[Utterance]) -> dict[str, object]:
    """Returns the names, numbers and texts that can be said now, by source; the preferred ones first."""
    records, latest = memory.records, utterances[0] if utterances else None
    goal, town = records.task.goal, records.town
    found: dict[str, object] = {} if goal is None else {"goal": goal.name, "goal_street": goal.street}
    for kind in (NotedEvent.DONE, NotedEvent.ADDED, NotedEvent.DROPPED, NotedEvent.MOVED, NotedEvent.FORMER):
        happened = memory.event(kind)
        if happened is not None and view.time - happened[0] < 1.0:
            found[kind.name.lower()] = happened[1]
    if latest is not None and view.time - latest.time < 8.0:
        found |= {f"place{k}": name for k, name in enumerate(latest.places[:2])}
        found |= {f"street{k}": name for k, name in enumerate(latest.streets[:2])}
    later = [view.landmark(one.landmark) for one in view.subgoals if one.open and one.index != records.task.target]
    named = [mark.name for mark in later if mark is not None and (goal is None or mark.name is not goal.name)]
    found |= {f"later{k}": name for k, name in enumerate(named[:2])}
    step = next_step(records, view)
    if step is not None and step.junction is not None:
        found["onto"] = street_of(view.raw, town, step.junction.exit.lane)
    found |= _pointers(step, latest)
    found["here"] = street_of(view.raw, town, view.lane)
    found["new_street"] = first_new_street(view.raw, town, view.lane, records.route.progress)
    if goal is not None:
        near = famous_nearby(goal, view, records.config.near_landmark)
        found["near"] = None if near is None else near.name
        cross = corner_of(town, town.lanes[goal.lane].street, goal.x, goal.y)
        names = view.raw["street_names"]
        found["cross"] = StreetName(int(names[cross])) if cross is not None and cross < len(names) else None
    beside = nearest_landmark(view.raw, view.landmarks, *view.position)
    found["beside"] = None if beside is None else beside.name
    found |= _numbers(memory, view, step)
    found |= _texts(memory, view)
    unnamed = (None, StreetName.UNKNOWN, LandmarkName.UNKNOWN)
    return {name: value for name, value in found.items() if value not in unnamed}


def _pointers(step: RouteStep | None, latest: Utterance | None) -> dict[str, object]:
    """Returns action and direction of the next step, and the names in the car's utterance."""
    found: dict[str, object] = {} if step is None else {"manoeuvre": step.action, "turn": step.direction}
    if latest is None:
        return found
    values = [value for act in latest.heard.acts for value in act.ordered]
    asked = latest.asked
    for name, kind, argument in (("said_action", ActionValue, "action"), ("said_object", ObjectClass, "object")):
        named = [value for value in values if isinstance(value, kind) and value.label not in ("Unknown", "Queried")]
        told = None if asked is None else asked.get(argument)
        found[name] = told if isinstance(told, kind) else next(iter(named), None)
    return {**found, "said_turn": latest.heard.words.direction}


def _numbers(memory: SessionMemory, view: ParticipantView, step: RouteStep | None) -> dict[str, object]:
    """Returns distances and speeds; whole numbers are of contents, others of their words."""
    records, progress = memory.records, memory.records.route.progress
    found: dict[str, object] = {}
    if progress is not None and step is not None:
        left = progress.left(view.station)
        if is_last_stretch(records, view) and 0.0 < left < 200.0:
            ahead = max(left - 3.0 * view.speed, 10.0)
            found |= {"ahead": ahead, "ahead_told": 10 * round(ahead / 10.0)}
            found |= {"rest": max(left - _SPOKEN, 1.0), "short_rest": max(left - _SHORT, 1.0)}
        unit = 10.0 if left < 195.0 else 50.0
        if 60.0 < left < 350.0:
            found["way"] = round(unit * round(left / unit))
    pace, usual = suitable_speed(sight(view.raw)), round(records.config.usual_speed)
    found |= {"passes": records.guidance.passes, "twice": 2}
    found |= {"suitable": pace, "brisk": pace + 5, "usual": usual, "faster": usual + 5, "v10": 10, "v15": 15, "v20": 20}
    return found


def _texts(memory: SessionMemory, view: ParticipantView) -> dict[str, object]:
    goal, purpose = memory.records.task.goal, purpose_of_target(memory.records, view)
    found: dict[str, object] = {}
    if purpose is not None:
        found |= {"@person": purpose.person, "@item": purpose.items[0] if purpose.items else None}
        found |= {"@purpose": purpose.action, "@reason": purpose.reason}
    if goal is not None:
        found |= {f"@feature{k}": text for k, text in enumerate(features_of(goal.name))}
    return found


# --- Forms ------------------------------------------------------------------------------------------------------------


_ANSWERS: Final = frozenset({DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.REPLY_U, DialogueMove.CONFIRM})
_POINTERS: Final = ((ORDERING_MOVES, ("manoeuvre", "turn")), (_ANSWERS, ("said_action", "said_turn", "said_object")))
"""Sources of actions, directions and objects, by the moves that take them from there."""


def form_of(remark: Remark, available: Mapping[str, object]) -> str | None:
    """Returns the form of a remark; None if it has a name, number or text without a source."""
    if any(said.predicate is Predicate.NEAR and said.get("object") is not None for said in remark.meaning):
        return None  # the sign at the place is not observed
    texts = {value: name for name, value in available.items() if name.startswith(TEXT_MARK)}
    plain = {name: value for name, value in available.items() if not name.startswith(TEXT_MARK)}
    try:
        content = remark.wording.content
        coded = replace(
            remark,
            meaning=tuple(_coded(said, texts) for said in remark.meaning),
            wording=_reworded(remark.wording, None if content is None else _coded(content, texts)),
        )
    except LookupError:
        return None
    form = remark_forms.form_of(coded, plain)
    if form is None:
        return None
    names = next((names for moves, names in _POINTERS if remark.act.move in moves), ())
    constants = {
        (type(value).__name__, getattr(value, "name", "")): name
        for name in names
        if (value := available.get(name)) is not None
    }
    page = _pointing(json.loads(form), constants)
    page["slots"] = sorted(page["slots"])
    if remark.urgent:
        page["urgent"] = True
    return json.dumps(page, separators=(",", ":"), sort_keys=True)


def _pointing(page: Any, constants: Mapping[tuple[str, str], str]) -> Any:
    """Returns a form in which constants are replaced by the sources that they can be taken from."""
    if isinstance(page, dict):
        return {name: _pointing(item, constants) for name, item in page.items()}
    if not isinstance(page, list):
        return page
    if len(page) == 2 and all(isinstance(item, str) for item in page) and (page[0], page[1]) in constants:
        return ["from", constants[page[0], page[1]]]
    return [_pointing(item, constants) for item in page]


def _coded(said: Proposition, texts: Mapping[object, str]) -> Proposition:
    """Returns a proposition with its texts replaced by their sources; raises `LookupError` if one has none."""
    arguments = tuple((name, texts[value] if name in TEXTS else value) for name, value in said.arguments)
    return Proposition(said.predicate, arguments, said.negated)


def _reworded(wording: Wording, content: Proposition | None) -> Wording:
    """Returns the particulars of words with another content, without the number of a junction."""
    names = ("direction", "faster", "speed", "lights", "distance", "dropped", "topic")
    return Wording(**{name: getattr(wording, name) for name in names}, content=content)


def filled(form: str, available: Mapping[str, object], *, joined: bool = False) -> Remark | None:
    """Returns the remark of a form with the current names, numbers and texts; None if a source is missing."""
    found = remark_forms.filled(form, available, joined=joined)
    if found is None:
        return None
    try:
        content = found.wording.content
        return replace(
            found,
            meaning=tuple(_decoded(said, available) for said in found.meaning),
            wording=_reworded(found.wording, None if content is None else _decoded(content, available)),
            urgent=bool(json.loads(form).get("urgent", False)),
        )
    except LookupError:
        return None


def _decoded(said: Proposition, available: Mapping[str, object]) -> Proposition:
    arguments: list[tuple[str, Any]] = []
    for name, value in said.arguments:
        text = isinstance(value, str) and name in TEXTS and value.startswith(TEXT_MARK)
        arguments.append((name, available[str(value)] if text else value))
    return Proposition(said.predicate, tuple(arguments), said.negated)


def sources_of(form: str) -> frozenset[str]:
    """Returns the names of the sources that a form needs."""
    return frozenset() if form == STOP_FORM else remark_forms.sources_of(form)


def is_yes(form: str) -> bool:
    """Returns whether a form says yes to a question."""
    return _move_of(form) in (DialogueMove.REPLY_Y.label, DialogueMove.CONFIRM.label)


def is_no(form: str) -> bool:
    """Returns whether a form says no to a question."""
    return _move_of(form) == DialogueMove.REPLY_N.label


def _move_of(form: str) -> str | None:
    return None if form in ("", STOP_FORM) else str(json.loads(form)["move"])


_PLACES: Final = (
    "goal", "done", "added", "dropped", "moved", "former", "place0", "place1", "later0", "later1", "near", "beside",
)  # fmt: skip
_VALUES: Final[Mapping[str, object]] = {
    "manoeuvre": ActionValue.J_TURN,
    "turn": Direction.LEFT,
    "said_action": ActionValue.J_TURN,
    "said_turn": Direction.LEFT,
    "said_object": ObjectClass.VEHICLES,
}
_STREETS: Final = ("goal_street", "street0", "street1", "onto", "here", "new_street", "cross")


def check_form(form: str) -> None:
    """Raises `ValueError`, `LookupError` or `TypeError` if a text from a file is not a form of a remark."""
    if form != STOP_FORM:
        remark_forms.check_form(form, sources_of(form), filled, _example)


def _example(source: str) -> object:
    """Returns an example of a source."""
    if source.startswith(TEXT_MARK):
        return "text"
    if source in _VALUES:
        return _VALUES[source]
    if source in _PLACES:
        return LandmarkName.KFC
    return StreetName.BEAL if source in _STREETS else 1


# --- Stop at the target -----------------------------------------------------------------------------------------------

STOP_FORM: Final = "stop"
"""Form of the remark that stops the car at the target, whose words are chosen in advance (`SessionMemory.chosen`)."""


def is_stop(remark: Remark, memory: SessionMemory, view: ParticipantView) -> bool:
    """Returns whether a remark stops the car at the target: an instruction, or the statement "this is the place"."""
    if not is_last_stretch(memory.records, view) or view.standing:
        return False
    stops = remark.act.move is DialogueMove.INSTRUCT and remark.act.slots == {ActionValue.STOP}
    return stops or remark.wording.topic == "here"


def stop_remark(memory: SessionMemory) -> Remark | None:
    """Returns the remark that stops the car, in the words chosen before; None if none are chosen."""
    guidance, goal = memory.records.guidance, memory.records.task.goal
    if not guidance.stop_text:
        return None
    if not guidance.points_out:
        stop = order(DialogueMove.INSTRUCT, ActionValue.STOP, urgent=True)
        return replace(stop, text=guidance.stop_text)
    here = Proposition.of(Predicate.CLOSE, place=None if goal is None else goal.name)
    said = intend(CommunicativeFunction.INFORM, here, elided=("place",), wording=Wording(topic="here"), urgent=True)
    return replace(said, text=guidance.stop_text)
