"""Forms of remarks: remarks without their names and numbers, each of which is replaced by its source.

A remark is an act with the propositions that it states or asks and the details of its wording. In its form, each name
of a place or street and each number is replaced by where it is taken from: the goal, a place just named, the street of
an exit, the time that the route takes. The network chooses a form, and thereby act, content and sources; `filled`
inserts the current values of the sources. The grammar words the act, as for the scripted roles.
"""

from __future__ import annotations

import enum
import json
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Final

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import PropKind, Sensor, WeatherParameter
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark
from dorothie_gym.support.input_files import parse_json

_ENUMS: Final = {
    kind.__name__: kind
    for kind in (
        ActionValue, StreetName, LandmarkName, GoalStatus, ObjectClass, Direction, PropKind, Sensor, WeatherParameter
    )
}  # fmt: skip
_OPEN: Final = ("QUERIED", "UNKNOWN")
_WORDING: Final = ("topic", "direction", "faster", "lights", "speed", "distance", "dropped", "ordinal")

TEXT_MARK: Final = "@"
"""First character of the source of a text within a form."""

Sources = Mapping[str, object]
"""Names and numbers that a remark can contain at this moment, by source."""


def form_of(remark: Remark, available: Sources) -> str | None:
    """Returns the form of a remark; None if it has a name or number without a source, or free words."""
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
    """Returns the remark of a form with the current names and numbers; None if a source is missing."""
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


def check_form(
    form: str, needed: Collection[str], fill: Callable[[str, Sources], Remark | None], example: Callable[[str], object]
) -> None:
    """Raises `ValueError`, `LookupError` or `TypeError` if a text from a file is not a valid form of a remark.

    Args:
        form: the text.
        needed: names of the sources that it needs.
        fill: returns the remark of a form.
        example: returns the possible values of a source.
    """
    if not isinstance(parse_json(form, "form"), dict):
        raise ValueError(form[:80])
    try:
        found = fill(form, {name: example(name) for name in needed})
    except StopIteration:  # there is no such move
        found = None
    if found is None:
        raise ValueError(form[:80])


def sources_of(form: str) -> frozenset[str]:
    """Returns the names of the sources that a form needs, of texts as well."""
    found: set[str] = set()

    def search(page: object) -> None:
        if isinstance(page, list):
            text = len(page) == 2 and page[0] == "text" and str(page[1]).startswith(TEXT_MARK)
            if text or (len(page) == 2 and page[0] == "from"):
                found.add(str(page[1]))
            for item in page:
                search(item)
        elif isinstance(page, dict):
            for item in page.values():
                search(item)

    search(json.loads(form))
    return frozenset(found)


def topic_of(remark: Remark) -> str:
    """Returns the topic of a remark: its predicate or, without content, its move."""
    return str(remark.meaning[0].predicate) if remark.meaning else remark.act.move.label
