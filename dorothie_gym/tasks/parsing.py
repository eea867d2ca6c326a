"""Reads storyboard templates from files and from the ones that come with the package."""

from __future__ import annotations

from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from dorothie_gym.tasks.catalogue import find_kind
from dorothie_gym.tasks.errors import StoryboardError
from dorothie_gym.tasks.fields import FieldReader
from dorothie_gym.tasks.lenient_json import read_json
from dorothie_gym.tasks.templates import Dependent, StoryboardTemplate, SubgoalTemplate, Variable
from dorothie_gym.tasks.validation import check

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
)


def template_names() -> tuple[str, ...]:
    """Names of the templates that come with the package, sorted."""
    return tuple(sorted(entry.name.removesuffix(".json") for entry in _SHIPPED.iterdir()))


def load_template(name_or_path: str | Path) -> StoryboardTemplate:
    """Reads a template.

    Args:
        name_or_path: the name of one that comes with the package, or the path of a JSON file.

    Raises:
        StoryboardError: there is no such template, or it is no valid one.
    """
    if isinstance(name_or_path, str) and name_or_path in template_names():
        text = (_SHIPPED / f"{name_or_path}.json").read_text(encoding="utf-8")
        return parse_template(text, name_or_path)
    path = Path(name_or_path)
    if isinstance(name_or_path, str) and path.suffix == "" and path.name == name_or_path and not path.exists():
        known = ", ".join(template_names())
        raise StoryboardError(name_or_path, "name", f"there is no such template; use one of {known}, or a .json file")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        reason = f"cannot be read ({error.strerror}); give the path of a template"
        raise StoryboardError(str(name_or_path), "file", reason) from error
    except UnicodeDecodeError as error:
        reason = f"is not UTF-8 text (byte {error.start}); save it as UTF-8"
        raise StoryboardError(str(name_or_path), "file", reason) from error
    return parse_template(text, path.stem, source=str(name_or_path))


def parse_template(text: str, name: str, *, source: str | None = None) -> StoryboardTemplate:
    """Reads a template from its text.

    Args:
        text: JSON; trailing commas and raw line breaks inside strings are accepted.
        name: name of the template.
        source: what errors call it; by default its name.

    Raises:
        StoryboardError: not JSON, or no valid template: names the field and the reason.
    """
    source = source or name
    top = FieldReader(source, "", _object(source, "template", read_json(text, source)))
    top.check_known(_TOP_FIELDS)
    variables = tuple(Variable(name=row, category=text) for row, text in top.pairs("variables", "category"))
    hidden = top.names("hidden_from_wizard") + top.names("hidden_from_co_wizard")
    template = StoryboardTemplate(
        name=source,
        story=top.text("story"),
        subgoals=tuple(
            _subgoal(FieldReader(source, path, _object(source, path, item)))
            for index, item in enumerate(top.items("subgoals"))
            for path in (f"subgoals[{index}]",)
        ),
        variables=variables,
        dependents=tuple(_dependent(top, *pair) for pair in top.pairs("dependents", "VAR.attribute")),
        hidden=tuple(dict.fromkeys(hidden)),
    )
    check(template)
    return replace(template, name=name)


def _object(source: str, field: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise StoryboardError(source, field, f"must be an object in braces, not {type(value).__name__}")
    return value


def _dependent(top: FieldReader, name: str, expression: str) -> Dependent:
    variable, dot, attribute = expression.removeprefix("$").partition(".")
    if not (variable and dot and attribute):
        top.fail(f"dependents.{name}", f'{expression!r} must read "VAR.attribute"')
    return Dependent(name=name, variable=variable, attribute=attribute)


def _subgoal(fields: FieldReader) -> SubgoalTemplate:
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
    )


def _destination(fields: FieldReader, field: str) -> str | None:
    """A destination as templates keep it: "$VARIABLE", or the ontology's label of the landmark that is named."""
    text = fields.optional_text(field)
    if text is None or text.startswith("$"):
        return text
    kind = find_kind(text)
    if kind is None:
        fields.fail(field, f"{text!r} is neither a $VARIABLE nor a landmark; name one of the two")
    return kind.name.label


def _delete_after(fields: FieldReader) -> tuple[int | None, bool]:
    """The two readings of `delete_after_subgoal`: a subgoal's number, or (in published templates) a flag.

    The flag means that whoever stands at the destination is gone once the subgoal is reached, as a person who has
    been picked up.
    """
    value = fields.values.get("delete_after_subgoal")
    if value is None or isinstance(value, bool):
        return None, bool(value)
    if not isinstance(value, int):
        fields.fail("delete_after_subgoal", f"must be a subgoal's number, true or false, not {value!r}")
    return value, False
