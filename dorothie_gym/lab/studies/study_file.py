"""Reading of study files: strict YAML, a schema, and checks across fields; errors name file, line and field."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, NoReturn

import msgspec
import yaml

from dorothie_gym.errors import DorothieGymError, InputFileError, PolicyLoadError, one_line, short_repr
from dorothie_gym.evaluation.tiers import find_tier
from dorothie_gym.lab.console.seating import Occupancy, plan_seat
from dorothie_gym.lab.studies.expectations import explain
from dorothie_gym.lab.studies.items import Choice, Number
from dorothie_gym.lab.studies.stages import QUESTIONNAIRES
from dorothie_gym.lab.studies.study import HUMAN, Method, Scenario, Study
from dorothie_gym.maps.catalogue import load_town
from dorothie_gym.maps.default_lights import split_lights
from dorothie_gym.support.input_files import read_text
from dorothie_gym.support.schemas import convert
from dorothie_gym.tasks.parsing import load_template

MAX_STUDY: Final = 1_000_000
"""Largest study file [bytes]."""

_DEEPEST: Final = 20
_UNPRINTABLE: Final = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
"""Control characters and halves of characters, which escapes can give."""

_PLACE: Final = re.compile(r" - at `(?:key` in `)?\$(.*)`$")
_INDEX: Final = re.compile(r"([^.\[\]]+)|\[(\d+)\]")


class _Loader(yaml.SafeLoader):
    """Loader of YAML 1.2's core types: "no", "on" and dates are texts."""


_Loader.yaml_implicit_resolvers = {}
for _tag, _pattern, _first in (
    ("bool", r"true|false", "tf"),
    ("null", r"null|~", "n~"),
    ("int", r"[-+]?(0|[1-9][0-9]{0,17})", "-+0123456789"),
    ("float", r"[-+]?([0-9]{1,18}\.[0-9]{0,18}|\.[0-9]{1,18}|[0-9]{1,18})([eE][-+]?[0-9]{1,2})?", "-+.0123456789"),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(rf"^(?:{_pattern})$"), list(_first))
_Loader.add_implicit_resolver("tag:yaml.org,2002:null", re.compile("^$"), [""])


def read_study(path: Path) -> Study:
    """Returns the study of a file. Towns, storyboards and policies are not looked up; see `check_sources`.

    Raises:
        InputFileError: the file cannot be read as a study; the message names the line and the field.
    """
    try:
        text = read_text(path, MAX_STUDY)
    except OSError as error:
        raise InputFileError(path, f"cannot be read ({error.strerror}); check the path") from None
    root = _compose(path, text)
    value = _plain(path, root)
    try:
        study = convert(value, Study)
    except msgspec.ValidationError as error:
        place = _PLACE.search(str(error))
        reason, field = (str(error)[: place.start()], place[1]) if place else (str(error), "")
        _fail(path, root, field, explain(reason, Study, _INDEX.findall(field)))
    except RecursionError:
        _fail(path, root, "", "is nested too deeply")
    for field, reason in _faults(study):
        _fail(path, root, field, reason)
    return study


def _fail(path: Path, root: yaml.Node, field: str, reason: str) -> NoReturn:
    """Raises the error of a field such as ".conditions[1].name"."""
    node: yaml.Node = root
    for name, index in _INDEX.findall(field):
        below = _child(node, name, index)
        if below is None:
            break
        node = below
    shown = field.removeprefix(".")
    place = f"line {node.start_mark.line + 1}" + (f", {shown}" if shown else "")
    raise InputFileError(path, one_line(reason), place)


def _child(node: yaml.Node, name: str, index: str) -> yaml.Node | None:
    if index and isinstance(node, yaml.SequenceNode) and int(index) < len(node.value):
        found: yaml.Node = node.value[int(index)]
        return found
    if isinstance(node, yaml.MappingNode):
        return next((value for key, value in node.value if key.value == name), None)
    return None


# --- YAML -------------------------------------------------------------------------------------------------------------


def _compose(path: Path, text: str) -> yaml.Node:
    try:
        depth = 0
        for event in yaml.parse(text, Loader=_Loader):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            line = f"line {event.start_mark.line + 1}" if event.start_mark else ""
            if depth > _DEEPEST:
                raise InputFileError(path, f"is nested more than {_DEEPEST} deep; check the brackets", line)
            if isinstance(event, yaml.AliasEvent):
                raise InputFileError(path, f"the alias *{event.anchor} is not read; write the text out", line)
        root = yaml.compose(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"line {mark.line + 1}" if mark else ""
        remedy = "check colons and indents, and put text with signs such as : ? , [ in quotes"
        raise InputFileError(path, f"is not YAML ({one_line(error.problem)}); {remedy}", place) from None
    except yaml.YAMLError as error:
        raise InputFileError(path, f"is not YAML ({one_line(error)})") from None
    if root is None:
        raise InputFileError(path, "is empty; `dorothie-gym study init FILE` writes an example")
    return root


def _plain(path: Path, node: yaml.Node) -> Any:
    """Returns the value of a node in JSON types."""
    line = f"line {node.start_mark.line + 1}"
    if isinstance(node, yaml.MappingNode):
        fields: dict[str, Any] = {}
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode) or key.tag.endswith(":merge") or not key.value.isprintable():
                raise InputFileError(path, "a name is expected before the colon", line)
            if key.value in fields:
                place = f"line {key.start_mark.line + 1}"
                raise InputFileError(path, f"{short_repr(key.value)} is there twice; remove one", place)
            fields[key.value] = _plain(path, value)
        return fields
    if isinstance(node, yaml.SequenceNode):
        return [_plain(path, each) for each in node.value]
    kind = node.tag.removeprefix("tag:yaml.org,2002:")
    if kind not in ("str", "bool", "null", "int", "float"):
        raise InputFileError(path, f"the tag {short_repr(node.tag)} is not read; remove it", line)
    text = str(node.value)
    if found := _UNPRINTABLE.search(text):
        raise InputFileError(path, f"the character {found[0]!a} cannot be shown; remove it", line)
    try:
        if kind in ("int", "float"):
            return int(text) if kind == "int" else float(text)
    except ValueError:
        raise InputFileError(path, f"{short_repr(text)} is no {kind}; remove the tag", line) from None
    return {"bool": text == "true", "null": None}.get(kind, text)


# --- Checks across fields ---------------------------------------------------------------------------------------------


def _faults(study: Study) -> Iterator[tuple[str, str]]:
    yield from _repeated("conditions", [each.name for each in study.conditions])
    for k, condition in enumerate(study.conditions):
        if not condition.people:
            yield f".conditions[{k}]", f"no role is {HUMAN!r}; a study needs people in each condition"
    if study.assignment.method is Method.LATIN_SQUARE and len({each.people for each in study.conditions}) > 1:
        yield ".conditions", "people play the same roles in all conditions of a balanced Latin square; here they differ"
    for role in study.people:
        if study.texts.instructions.of(role) is None:
            yield ".texts.instructions", f"the text for {role.value!r} is missing, which people play"
    if study.session.speech and study.consent.voice is None:
        yield ".consent", "field 'voice' is missing: where people can speak, they must agree that it is recorded"
    for name in QUESTIONNAIRES.values():
        items = study.questionnaire(name)
        yield from _repeated(f"questionnaires.{name}", [item.id for item in items], "id")
        for k, item in enumerate(items):
            field = f".questionnaires.{name}[{k}]"
            if isinstance(item, Number) and item.min > item.max:
                yield field, f"min is {item.min:g}, more than max, {item.max:g}"
            if isinstance(item, Choice):
                yield from _repeated(f"questionnaires.{name}[{k}].options", item.options, "")
    if study.recruitment.required and not study.recruitment.parameters:
        yield ".recruitment.required", "there is no parameter that could be required; name one in 'parameters'"
    yield from _repeated("recruitment.parameters", study.recruitment.parameters, "")


def _repeated(field: str, names: Sequence[str], key: str = "name") -> Iterator[tuple[str, str]]:
    for name, number in Counter(names).items():
        if number > 1:
            last = len(names) - 1 - names[::-1].index(name)
            yield f".{field}[{last}]" + (f".{key}" if key else ""), f"{short_repr(name)} is there twice; rename one"


# --- Sources ----------------------------------------------------------------------------------------------------------


def check_sources(study: Study, path: Path) -> None:
    """Looks up the towns, storyboards and policies of a study.

    Args:
        study: the study.
        path: its file; names of files in it are relative to its folder.

    Raises:
        InputFileError: one is missing or cannot be used; the message names the field.
    """
    if study.session.tier is not None:
        try:
            find_tier(study.session.tier)
        except ValueError as error:
            raise InputFileError(path, str(error), "session.tier") from None
    scenarios = [(f"scenarios[{k}]", scenario) for k, scenario in enumerate(study.scenarios)]
    if study.tutorial is not None:
        scenarios.append(("tutorial.scenario", study.tutorial.scenario))
    for field, scenario in scenarios:
        town, storyboard = sources(scenario, path.parent)
        try:
            load_town(town)
            if storyboard is not None:
                load_template(storyboard)
        except DorothieGymError as error:
            raise InputFileError(path, str(error), field) from None
    for k, condition in enumerate(study.conditions):
        for role, player in condition.players.items():
            try:
                if plan_seat(player, role).occupancy is Occupancy.OPEN:
                    raise PolicyLoadError(f"{role.value}: seats of studies are not open; give {HUMAN!r} or a policy")
            except DorothieGymError as error:
                raise InputFileError(path, str(error), f"conditions[{k}].{role.value}") from None


def sources(scenario: Scenario, folder: Path) -> tuple[str, str | None]:
    """Returns town and storyboard of a scenario; files are looked up in a folder."""
    town, storyboard = scenario.town, scenario.storyboard
    if split_lights(town)[0].endswith((".yaml", ".yml", ".xodr")):
        town = str(folder / town)
    if storyboard is not None and storyboard.endswith(".json"):
        storyboard = str(folder / storyboard)
    return town, storyboard
