"""Remarks of the learned Co-Wizard: those of the corpus without their names, and where it takes the names from.

A remark is an act with the propositions that it states or asks and the particulars of its words. In a form (`form_of`),
each name of a place or street and each number is replaced by its source: the goal, a place just named, the street of an
exit, the time that the route takes. The network chooses a form, and thereby act, content and sources; `filled` puts in
what the sources are at this moment. The grammar words the act, as for the scripted roles.
"""

from __future__ import annotations

import enum
import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

from dorothie_gym.baselines.co_wizard.answers import answer_to, is_answer, said_again
from dorothie_gym.baselines.co_wizard.beliefs import seconds_to_goal
from dorothie_gym.baselines.co_wizard.hearing import Utterance
from dorothie_gym.baselines.co_wizard.memory import Memory
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Direction, Wording
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import PropKind, Sensor, WeatherParameter
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import nearest_landmark, street_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import direction_of, first_new_street
from dorothie_gym.policies.speech import Remark
from dorothie_gym.policies.view_range import sight, suitable_speed
from dorothie_gym.support.input_files import parse_json

_ENUMS: Final = {
    kind.__name__: kind
    for kind in (
        ActionValue, StreetName, LandmarkName, GoalStatus, ObjectClass, Direction, PropKind, Sensor, WeatherParameter
    )
}  # fmt: skip
_WHOLES: Final = ("answer", "again")
"""Sources of whole remarks: the answer to what was just asked, and the last remark said again."""

_OPEN: Final = ("QUERIED", "UNKNOWN")
_WORDING: Final = ("topic", "direction", "faster", "lights", "speed", "distance", "dropped", "ordinal")

Sources = Mapping[str, object]
"""Names and numbers that a remark can contain at this moment, by source."""


def sources(memory: Memory, view: CoWizardView, utterances: Sequence[Utterance]) -> dict[str, object]:
    """Returns the names and numbers that can be said now, by source; the preferred ones first."""
    town, latest = memory.town, utterances[0] if utterances else None
    wholes = {"answer": answer_to(latest, memory, view), "again": said_again(latest, memory)}
    mark = next((mark for mark in view.landmarks if mark.row == memory.goal_mark), None)
    progress = memory.navigator.route.progress
    found: dict[str, object] = {**wholes, "goal": memory.goal}
    if latest is not None and view.time - latest.time < 8.0:
        found |= {f"place{k}": name for k, name in enumerate(latest.places[:2])}
        found |= {f"street{k}": name for k, name in enumerate(latest.streets[:2])}
        speed = latest.heard.words.speed
        found |= {} if speed is None else {"said_speed": round(speed)}
    found["former"] = memory.former
    found["goal_street"] = None if mark is None else mark.street
    for place in found.get("place0"), found.get("place1"):
        alike = [one for one in view.landmarks if one.name is place]
        if alike:
            found.setdefault("place_street", alike[0].street)
    found["here"] = street_of(view.raw, town, view.lane)
    if progress is not None:
        crossings = [crossing for _, crossing in zip(range(6), progress.crossings(town, view.station), strict=False)]
        turns = [one for one in crossings if one.direction in (Direction.LEFT, Direction.RIGHT)]
        found |= {f"turn{k}": street_of(view.raw, town, one.exit.lane) for k, one in enumerate(turns[:2])}
        found["new_street"] = first_new_street(view.raw, town, view.lane, progress)
        found["seconds"] = seconds_to_goal(memory, view)
    for way in () if view.choice is None else view.choice.exits:
        found.setdefault(f"to_{direction_of(way)}", street_of(view.raw, town, way.lane))
    near = nearest_landmark(view.raw, view.landmarks, *view.position)
    found["near"] = None if near is None else near.name
    pace = suitable_speed(sight(view.raw))
    found |= {"suitable": pace, "slow": pace - 5, "sight": 10 * round(sight(view.raw) / 10.0)}
    if memory.standing_since is not None:
        found["since"] = round(memory.standing_since)
    unnamed = (None, StreetName.UNKNOWN, LandmarkName.UNKNOWN)
    return {name: value for name, value in found.items() if value not in unnamed}


def form_of(remark: Remark, available: Sources) -> str | None:
    """Returns the form of a remark; None if it has a name or number without a source, or free words."""
    answer, again = (available.get(name) for name in _WHOLES)
    if isinstance(again, Remark) and (remark.act, remark.meaning) == (again.act, again.meaning):
        return _whole_form("again")
    if isinstance(answer, Remark) and is_answer(remark, answer):
        return _whole_form("answer")
    try:
        wording = {
            name: _coded(value, available) for name in _WORDING if (value := getattr(remark.wording, name)) is not None
        }
        content = remark.wording.content
        slots = sorted(_coded(value, available) for value in remark.act.slots)
        page = {
            "move": remark.act.move.label,
            "slots": slots,
            "meaning": [_form(said, available) for said in remark.meaning],
            "content": None if content is None else _form(content, available),
            "wording": wording,
        }
    except LookupError:
        return None
    return json.dumps(page, separators=(",", ":"), sort_keys=True)


def _whole_form(source: str) -> str:
    return json.dumps({"whole": ["from", source]}, separators=(",", ":"))


def _form(said: Proposition, available: Sources) -> list[Any]:
    return [
        str(said.predicate),
        int(said.negated),
        [[name, _coded(value, available)] for name, value in said.arguments],
    ]


def _coded(value: object, available: Sources) -> Any:
    """Returns a value as JSON: constants by their names, names and numbers by their sources."""
    if isinstance(value, Proposition):
        return _form(value, available)
    if isinstance(value, bool):
        return ["bool", int(value)]
    named = isinstance(value, LandmarkName | StreetName) and value.name not in _OPEN
    if named or isinstance(value, int | float):
        exact = [name for name, known in available.items() if type(known) is type(value) and known == value]
        return ["from", exact[0] if exact else _nearest(value, available)]
    if isinstance(value, enum.Enum) and type(value).__name__ in _ENUMS:
        return [type(value).__name__, value.name]
    if isinstance(value, str) and " " not in value:
        return ["text", value]
    raise LookupError(value)


def _nearest(value: object, available: Sources) -> str:
    """Returns the source of a number that is almost the same; raises `LookupError` if there is none."""
    if isinstance(value, LandmarkName | StreetName) or not isinstance(value, int | float):
        raise LookupError(value)
    near = [(abs(known - value), name) for name, known in available.items() if isinstance(known, int | float)]
    if not near or min(near)[0] > 2.0:
        raise LookupError(value)
    return min(near)[1]


def filled(form: str, available: Sources, *, joined: bool = False) -> Remark | None:
    """Returns the remark of a form with the present names and numbers; None if a source is missing."""
    page = json.loads(form)
    try:
        if "whole" in page:
            whole = _decoded(page["whole"], available)
            return replace(whole, text="", joined=joined) if isinstance(whole, Remark) else None
        slots = [_decoded(code, available) for code in page["slots"]]
        wording = {name: _decoded(code, available) for name, code in page["wording"].items()}
        content = None if page["content"] is None else _filled(page["content"], available)
        move = next(move for move in DialogueMove if move.label == page["move"])
        return Remark(
            act=DialogueAct.of(move, *slots),
            wording=Wording(**wording, content=content),
            meaning=tuple(_filled(said, available) for said in page["meaning"]),
            joined=joined,
        )
    except LookupError:
        return None


def _filled(form: Sequence[Any], available: Sources) -> Proposition:
    predicate, negated, arguments = form
    return Proposition(
        Predicate(predicate), tuple((name, _decoded(code, available)) for name, code in arguments), bool(negated)
    )


def _decoded(code: Sequence[Any], available: Sources) -> Any:
    kind, value = code[0], code[1]
    if len(code) == 3:
        return _filled(code, available)
    if kind == "from":
        return available[value]
    if kind == "bool":
        return bool(value)
    return value if kind == "text" else _ENUMS[kind][value]


def check_form(form: str) -> None:
    """Raises `ValueError`, `LookupError` or `TypeError` if a text from a file is no form of a remark."""
    if not isinstance(parse_json(form, "form"), dict):
        raise ValueError(form[:80])
    filled(form, {name: _example(name) for name in sources_of(form)})


def _example(source: str) -> object:
    """Returns what a source can be."""
    if source in _WHOLES:
        return Remark(act=DialogueAct.of(DialogueMove.REPLY_U))
    if source in ("goal", "former", "near", "place0", "place1"):
        return LandmarkName.KFC
    numbers = ("seconds", "said_speed", "suitable", "slow", "sight", "since")
    return 30 if source in numbers else StreetName.BEAL


def sources_of(form: str) -> frozenset[str]:
    """Returns the names of the sources that a form needs."""
    found: set[str] = set()

    def search(page: object) -> None:
        if isinstance(page, list):
            if len(page) == 2 and page[0] == "from":
                found.add(str(page[1]))
            for item in page:
                search(item)
        elif isinstance(page, dict):
            for item in page.values():
                search(item)

    search(json.loads(form))
    return frozenset(found)


def topic_of(remark: Remark) -> str:
    """Returns what a remark is about: its predicate or, without content, its move."""
    return str(remark.meaning[0].predicate) if remark.meaning else remark.act.move.label
