"""Storyboard templates from lenient JSON: typed fields, validation across fields, errors with file and field."""

from __future__ import annotations

import functools
import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import NoReturn

from dorothie_gym.errors import InputFileError, StoryboardError, did_you_mean
from dorothie_gym.support.files import JsonValue
from dorothie_gym.support.input_files import MAX_SMALL_JSON, parse_json, read_text
from dorothie_gym.tasks.binding import cast, longest_values
from dorothie_gym.tasks.catalogue import find_kind
from dorothie_gym.tasks.generated_storyboards import generate_template
from dorothie_gym.tasks.storyboard import (
    MESSAGE_LENGTH,
    Channel,
    Dependent,
    StoryboardTemplate,
    SubgoalTemplate,
    TaskMessage,
    TaskMessages,
    Variable,
    references,
    variable_of,
)
from dorothie_gym.tasks.storyboard_specification import is_generated, parse_specification

MAX_LIVE_SUBGOALS = 6
"""Maximum number of subgoals without a trigger: two to six landmarks to visit (paper, "Task Configuration")."""


def check(template: StoryboardTemplate) -> None:
    """Validates a template.

    Raises:
        StoryboardError: for the first invalid field, with the reason.
    """
    _check_names(template)
    _check_references(template)
    _check_number(template)
    _check_indices(template)
    _check_order(template)
    cast(template)
    _check_messages(template)


def _check_names(template: StoryboardTemplate) -> None:
    seen: set[str] = set()
    for field, name in _defined(template):
        if name in seen:
            raise StoryboardError(template.name, field, f"the name {name} is defined twice; rename one of them")
        seen.add(name)


def _defined(template: StoryboardTemplate) -> Iterator[tuple[str, str]]:
    yield from ((f"variables.{row.name}", row.name) for row in template.variables)
    yield from ((f"dependents.{row.name}", row.name) for row in template.dependents)


def _check_references(template: StoryboardTemplate) -> None:
    variables = tuple(row.name for row in template.variables)
    names = tuple(name for _, name in _defined(template))
    in_texts = [(field, name) for field, text in template.texts() for name in references(text)]
    to_landmarks = [(f"dependents.{row.name}", row.variable) for row in template.dependents]
    to_landmarks += [("hidden_from_wizard", name) for name in template.hidden]
    for index, subgoal in enumerate(template.subgoals):
        for field, ref in (("destination", subgoal.destination), ("change_destination", subgoal.change_destination)):
            name = variable_of(ref) if ref is not None else None
            if name is not None:
                to_landmarks.append((f"subgoals[{index}].{field}", name))
    _require(template, to_landmarks, variables, "variable")
    _require(template, in_texts, names, "variable or dependent")


def _require(
    template: StoryboardTemplate, wanted: Iterable[tuple[str, str]], known: Collection[str], what: str
) -> None:
    for field, name in wanted:
        if name not in known:
            listed = ", ".join(known) or "none"
            raise StoryboardError(template.name, field, f"{name!r} is no {what}; define it, or use one of: {listed}")


def _check_number(template: StoryboardTemplate) -> None:
    live = sum(not subgoal.trigger for subgoal in template.subgoals)
    if len(template.subgoals) < 2:
        reason = f"a template has at least 2 subgoals, the last one being the destination, not {len(template.subgoals)}"
        raise StoryboardError(template.name, "subgoals", reason)
    if live > MAX_LIVE_SUBGOALS:
        reason = f"at most {MAX_LIVE_SUBGOALS} subgoals may be without `trigger`, not {live}"
        raise StoryboardError(template.name, "subgoals", reason)


def _check_indices(template: StoryboardTemplate) -> None:
    last = len(template.subgoals) - 1
    for index, subgoal in enumerate(template.subgoals):
        given = [("after", other) for other in subgoal.after]
        if subgoal.delete_after_subgoal is not None:
            given.append(("delete_after_subgoal", subgoal.delete_after_subgoal))
        for field, other in given:
            where = f"subgoals[{index}].{field}"
            if not 0 <= other <= last:
                raise StoryboardError(template.name, where, f"there is no subgoal {other}; use 0 to {last}")
            if other == index:
                raise StoryboardError(template.name, where, f"subgoal {index} refers to itself; remove it")


def _check_order(template: StoryboardTemplate) -> None:
    """Checks that no subgoal waits for itself or for the final destination, whichever subgoals are live."""
    number = len(template.subgoals)
    for index, subgoal in enumerate(template.subgoals):
        for other in subgoal.after:
            # `other` is the final destination as long as all later subgoals await their trigger.
            if other > index and all(template.subgoals[k].trigger for k in range(other + 1, number)):
                reason = f"subgoal {index} cannot come after subgoal {other}: that is the destination, which comes last"
                raise StoryboardError(template.name, f"subgoals[{index}].after", reason)
    waiting = set(range(number))
    while free := {k for k in waiting if not waiting.intersection(template.subgoals[k].after)}:
        waiting -= free
    if waiting:
        cycle = ", ".join(str(k) for k in sorted(waiting))
        reason = f"the subgoals {cycle} wait for one another in a cycle; remove one `after`"
        raise StoryboardError(template.name, f"subgoals[{min(waiting)}].after", reason)


def _check_messages(template: StoryboardTemplate) -> None:
    """Checks that messages belong to exceptions of their subgoals, and are valid for all values of the names."""
    longest = longest_values(template)
    for index, subgoal in enumerate(template.subgoals):
        permitted = {"trigger": subgoal.trigger, "delete": subgoal.delete, "change": subgoal.change is not None}
        for kind, message in subgoal.messages.given():
            field = f"subgoals[{index}].messages.{kind}"
            if not permitted[kind]:
                reason = f"subgoal {index} has no `{kind}`; add it, or remove the message"
                raise StoryboardError(template.name, field, reason)
            length = len(str(message.filled(longest)))
            if length > MESSAGE_LENGTH:
                reason = (
                    f"has up to {length} characters with its sender and the longest values of its names; "
                    f"shorten it to {MESSAGE_LENGTH}"
                )
                raise StoryboardError(template.name, f"{field}.text", reason)


# --- parser -----------------------------------------------------------------------------------------------------------
# Strings are matched as a whole, so that commas inside them are kept.
_STRING_OR_LAST_COMMA = re.compile(r'"(?:\\.|[^"\\])*"|(?<=[^\s\[{,:])(\s*),(?=\s*[\]}])', re.DOTALL)


def read_json(text: str, source: str) -> JsonValue:
    """Parses lenient JSON: trailing commas and raw line breaks in strings are accepted.

    Args:
        text: the text.
        source: name of the text in error messages.

    Raises:
        StoryboardError: if the text is malformed (with line and column), or if an object contains a field twice.
    """
    # Commas are replaced by spaces, so that error positions refer to the file.
    strict = _STRING_OR_LAST_COMMA.sub(lambda match: match[0] if match[1] is None else f"{match[1]} ", text)
    try:
        return parse_json(strict, source, line_breaks=True)
    except InputFileError as error:
        raise StoryboardError(source, error.place or "text", error.reason) from None


_NAME = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True)
class TemplateFields:
    """Typed access to the fields of one JSON object of a template; all errors are `StoryboardError`.

    Attributes:
        template: name of the template in error messages.
        path: path of the object, e.g. "subgoals[1]"; empty at the top level.
        values: fields of the object.
    """

    template: str
    path: str
    values: dict[str, JsonValue]

    def fail(self, field: str, reason: str) -> NoReturn:
        """Raises a `StoryboardError` for a field of this object."""
        raise StoryboardError(self.template, f"{self.path}.{field}" if self.path else field, reason)

    def check_known(self, known: Collection[str]) -> None:
        """Raises an error if the object has a field that is not in `known`."""
        for field in self.values:
            if field not in known:
                self.fail(field, f"unknown field; the fields are {', '.join(known)}")

    def text(self, field: str) -> str:
        """Returns a required text with normalised white space."""
        text = self.optional_text(field)
        if text is None:
            self.fail(field, "is missing or empty; give a text")
        return text

    def optional_text(self, field: str) -> str | None:
        """Returns a text with normalised white space, or None if the field is absent or empty."""
        value = self.values.get(field, "")
        if not isinstance(value, str):
            self.fail(field, f"must be a text, not {_describe(value)}")
        return " ".join(value.split()) or None

    def flag(self, field: str) -> bool:
        """Returns a boolean; False if the field is absent."""
        value = self.values.get(field, False)
        if not isinstance(value, bool):
            self.fail(field, f"must be true or false, not {_describe(value)}")
        return value

    def items(self, field: str) -> list[JsonValue]:
        """Returns a list; empty if the field is absent."""
        value = self.values.get(field, [])
        if not isinstance(value, list):
            self.fail(field, f"must be a list, not {_describe(value)}")
        return value

    def object(self, field: str) -> TemplateFields:
        """Returns the fields of an object."""
        path = f"{self.path}.{field}" if self.path else field
        return TemplateFields(self.template, path, _object(self.template, path, self.values.get(field)))

    def indices(self, field: str) -> tuple[int, ...]:
        """Returns a list of distinct indices in ascending order."""
        found: set[int] = set()
        for item in self.items(field):
            if isinstance(item, bool) or not isinstance(item, int):
                self.fail(field, f"must be a list of subgoal numbers (the first is 0), not of {_describe(item)}")
            found.add(item)
        return tuple(sorted(found))

    def names(self, field: str) -> tuple[str, ...]:
        """Returns a list of variable names, without dollar signs."""
        found: list[str] = []
        for item in self.items(field):
            if not isinstance(item, str):
                self.fail(field, f"must be a list of variables' names, not of {_describe(item)}")
            found.append(item.removeprefix("$"))
        return tuple(found)

    def pairs(self, field: str, second: str) -> tuple[tuple[str, str], ...]:
        """Returns a list of [NAME, text] pairs; `second` describes the text in error messages."""
        found: list[tuple[str, str]] = []
        for index, item in enumerate(self.items(field)):
            where = f"{field}[{index}]"
            match item:
                case [str(written), str(value)]:
                    name, text = written.removeprefix("$"), value.strip()
                case _:
                    self.fail(where, f'must be ["NAME", "{second}"], not {_describe(item)}')
            if not _NAME.fullmatch(name):
                self.fail(where, f"{written!r} is no name; use letters, digits and underscores")
            if not text:
                self.fail(where, f"{name} has an empty {second}; give one")
            found.append((name, text))
        return tuple(found)


def _describe(value: JsonValue) -> str:
    if value is None:
        return "null"
    kinds = {
        dict: "an object",
        list: "a list",
        str: "a text",
        bool: "true or false",
        int: "a number",
        float: "a number",
    }
    shown = repr(value)
    return f"{kinds[type(value)]} ({shown if len(shown) <= 40 else shown[:37] + '...'})"


_SHIPPED = resources.files("dorothie_gym.tasks") / "data" / "storyboards"
_TOP_FIELDS = ("story", "subgoals", "variables", "dependents", "hidden_from_wizard", "hidden_from_co_wizard")
_SUBGOAL_FIELDS = (
    "destination",
    "description",
    "type",
    "after",
    "trigger",
    "delete",
    "change",
    "change_destination",
    "delete_after_subgoal",
    "reason",
    "messages",
)
_MESSAGE_FIELDS = ("from", "by", "text")


@functools.cache
def template_names() -> tuple[str, ...]:
    """Returns the names of the templates of the package, sorted."""
    return tuple(sorted(entry.name.removesuffix(".json") for entry in _SHIPPED.iterdir()))


def is_template_name(name: str) -> bool:
    """Returns whether `load_template` finds a template of a name without a file: a shipped or a generated one."""
    return name in template_names() or is_generated(name)


@functools.cache
def _shipped_stories() -> re.Pattern[str]:
    """Returns a pattern of the stories of the package's templates; variables and marks stand for any text."""
    stories = (load_template(name).story for name in template_names())
    return re.compile("|".join(_pattern(story) for story in stories))


def _pattern(story: str) -> str:
    """Returns a pattern of a story that also matches it with other accents or typographic marks, or truncated."""
    words = (".+" if references(part) or not part.isascii() else re.escape(part) for part in story.split())
    return " ".join(words)


def is_shipped_story(story: str) -> bool:
    """Returns whether the story of a session is that of a template of the package.

    Args:
        story: the text with values, as observations give it.
    """
    return _shipped_stories().fullmatch(" ".join(story.split())) is not None


def load_template(name_or_path: str | Path) -> StoryboardTemplate:
    """Loads a template.

    Args:
        name_or_path: name of a template of the package, `generated:SEED` or `generated:SEED,stops=N`, or path of a
            JSON file.

    Raises:
        StoryboardError: if the template does not exist or is invalid.
    """
    if isinstance(name_or_path, str) and name_or_path in template_names():
        return _shipped_template(name_or_path)
    if isinstance(name_or_path, str) and is_generated(name_or_path):
        return generate_template(parse_specification(name_or_path))
    path = Path(name_or_path)
    if isinstance(name_or_path, str) and path.suffix == "" and path.name == name_or_path and not path.exists():
        known, hint = ", ".join(template_names()), did_you_mean(name_or_path, template_names())
        reason = f"there is no such template; {hint}use one of {known}, or a .json file"
        raise StoryboardError(name_or_path, "name", reason)
    try:
        text = read_text(path, MAX_SMALL_JSON)
    except OSError as error:
        reason = f"cannot be read ({error.strerror}); give the path of a template"
        raise StoryboardError(str(name_or_path), "file", reason) from error
    except InputFileError as error:
        raise StoryboardError(str(name_or_path), "file", error.reason) from None
    return parse_template(text, path.stem, source=str(name_or_path))


@functools.cache
def _shipped_template(name: str) -> StoryboardTemplate:
    return parse_template((_SHIPPED / f"{name}.json").read_text(encoding="utf-8"), name)


def parse_template(text: str, name: str, *, source: str | None = None) -> StoryboardTemplate:
    """Parses and validates a template.

    Args:
        text: JSON; trailing commas and raw line breaks in strings are accepted.
        name: name of the template.
        source: name in error messages; `name` by default.

    Raises:
        StoryboardError: if the text is not JSON or not a valid template; names the field and the reason.
    """
    source = source or name
    top = TemplateFields(source, "", _object(source, "template", read_json(text, source)))
    top.check_known(_TOP_FIELDS)
    variables = tuple(Variable(name=row, category=text) for row, text in top.pairs("variables", "category"))
    hidden = top.names("hidden_from_wizard") + top.names("hidden_from_co_wizard")
    template = StoryboardTemplate(
        name=source,
        story=top.text("story"),
        subgoals=tuple(
            _subgoal(TemplateFields(source, path, _object(source, path, item)))
            for index, item in enumerate(top.items("subgoals"))
            for path in (f"subgoals[{index}]",)
        ),
        variables=variables,
        dependents=tuple(_dependent(top, *pair) for pair in top.pairs("dependents", "VAR.attribute")),
        hidden=tuple(dict.fromkeys(hidden)),
    )
    check(template)
    return replace(template, name=name)


def _object(source: str, field: str, value: JsonValue) -> dict[str, JsonValue]:
    if not isinstance(value, dict):
        raise StoryboardError(source, field, f"must be an object in braces, not {type(value).__name__}")
    return value


def _dependent(top: TemplateFields, name: str, expression: str) -> Dependent:
    variable, dot, attribute = expression.removeprefix("$").partition(".")
    if not (variable and dot and attribute):
        top.fail(f"dependents.{name}", f'{expression!r} must read "VAR.attribute"')
    return Dependent(name=name, variable=variable, attribute=attribute)


def _subgoal(fields: TemplateFields) -> SubgoalTemplate:
    fields.check_known(_SUBGOAL_FIELDS)
    kind = fields.optional_text("type") or "arrive"
    if kind != "arrive":
        fields.fail("type", f'{kind!r} is no type of subgoal; use "arrive" or leave it out')
    change, change_destination = fields.optional_text("change"), _destination(fields, "change_destination")
    if change is None and change_destination is not None:
        fields.fail("change", "is missing beside change_destination; give the new description")
    until, leaves = _delete_after(fields)
    return SubgoalTemplate(
        destination=_destination(fields, "destination") or fields.text("destination"),
        description=fields.text("description"),
        after=fields.indices("after"),
        trigger=fields.flag("trigger"),
        delete=fields.flag("delete") or until is not None,
        change=change,
        change_destination=change_destination,
        delete_after_subgoal=until,
        leaves=leaves,
        reason=_reason(fields),
        messages=_messages(fields),
    )


def _reason(fields: TemplateFields) -> str | None:
    reason = fields.optional_text("reason")
    if reason is not None and (reason.lower().startswith("because ") or reason[-1] in ".!?"):
        fields.fail("reason", "must be a clause as it follows 'because'; leave out that word and the full stop")
    return reason


def _messages(fields: TemplateFields) -> TaskMessages:
    if "messages" not in fields.values:
        return TaskMessages()
    kinds = fields.object("messages")
    kinds.check_known(tuple(TaskMessages.__dataclass_fields__))
    return TaskMessages(**{kind: _message(kinds.object(kind)) for kind in kinds.values})


def _message(fields: TemplateFields) -> TaskMessage:
    fields.check_known(_MESSAGE_FIELDS)
    sender, by = fields.text("from"), fields.optional_text("by") or Channel.TEXT_MESSAGE
    if ":" in sender:
        fields.fail("from", f"{sender!r} contains a colon; name the sender only")
    if by not in tuple(Channel):
        fields.fail("by", f"{by!r} is no way of sending a message; use one of {', '.join(Channel)}")
    return TaskMessage(sender=sender, channel=Channel(by), text=fields.text("text"))


def _destination(fields: TemplateFields, field: str) -> str | None:
    """Returns a destination: "$VARIABLE", or the ontology label of a landmark."""
    text = fields.optional_text(field)
    if text is None or text.startswith("$"):
        return text
    kind = find_kind(text)
    if kind is None:
        fields.fail(field, f"{text!r} is neither a $VARIABLE nor a landmark; name one of the two")
    return kind.name.label


def _delete_after(fields: TemplateFields) -> tuple[int | None, bool]:
    """Returns the two meanings of `delete_after_subgoal`: a subgoal index, or (in published templates) a flag.

    The flag marks a person at the destination who disappears once the subgoal is reached, e.g. by being picked up.
    """
    value = fields.values.get("delete_after_subgoal")
    if value is None or isinstance(value, bool):
        return None, bool(value)
    if not isinstance(value, int):
        fields.fail("delete_after_subgoal", f"must be a subgoal's number, true or false, not {value!r}")
    return value, False
