"""Tools of a role: the fields of its answer, one call each, and `wait`, which lets time pass.

Calls before `wait` fill the fields of one answer, so that parallel calls of a turn take effect together. The tools of a
role are the same in all sessions and turns; the choices of the moment are in the page.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from dorothie_gym.errors import short_repr
from dorothie_gym.ontology.roles import Role

if TYPE_CHECKING:
    from dorothie_gym.support.files import JsonValue

LOOK: Final = "look"
WAIT: Final = "wait"

_VALUE: Final = "value"
_SECONDS: Final = "seconds"


@dataclass(frozen=True, kw_only=True)
class ToolSpec:
    """Tool as frameworks for agents describe it.

    Attributes:
        name: name of the tool.
        description: what it does.
        argument: name of its only argument; empty if it has none.
        meaning: meaning of the argument.
        field: field of the answer that it fills; empty if it fills none.
    """

    name: str
    description: str
    argument: str = ""
    meaning: str = ""
    field: str = ""

    def parameters(self) -> dict[str, JsonValue]:
        """Returns the JSON schema of the arguments."""
        properties: dict[str, JsonValue] = {}
        if self.argument:
            kind = "number" if self.name == WAIT else "string"
            properties[self.argument] = {"type": kind, "description": self.meaning}
        required: list[JsonValue] = [self.argument] if self.field else []
        return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}

    def function(self) -> dict[str, JsonValue]:
        """Returns the tool in the form of OpenAI's interface (`tools` of a request)."""
        described: dict[str, JsonValue] = {"name": self.name, "description": self.description}
        return {"type": "function", "function": {**described, "parameters": self.parameters()}}

    def value_of(self, arguments: Mapping[str, Any]) -> Any:
        """Returns the value of the argument; None if it is left out and need not be given.

        Raises:
            ValueError: an argument is missing, or there is no such argument.
        """
        unknown = [name for name in arguments if name != self.argument]
        if unknown:
            known = f"its argument is {self.argument}" if self.argument else "it has no argument"
            raise ValueError(f"{self.name} has no argument {short_repr(unknown[0])}; {known}")
        if self.field and self.argument not in arguments:
            raise ValueError(f"{self.name} needs the argument {self.argument}: {self.meaning}")
        return arguments.get(self.argument)


def _field_tool(name: str, field: str, description: str, meaning: str) -> ToolSpec:
    return ToolSpec(name=name, description=description, argument=_VALUE, meaning=meaning, field=field)


_SAY = _field_tool("say", "say", "Says a sentence when time passes.", "the sentence")
_NOTE = _field_tool("note", "note", "Sets your note, which later pages show.", "the note, or add: WORDS to add to it")
_DRIVE = _field_tool("drive", "drive", "Chooses what the car does.", 'one of the choices under "You can drive"')
_GOAL = _field_tool("set_goal", "goal", "Sets the place that you drive to.", "a place of the page, or none")
_MARK = _field_tool(
    "mark",
    "mark",
    "Marks where you suppose a goal that is not on your map.",
    '"here", "20 m ahead", "beside PLACE" or "on STREET"',
)
_STATUS = _field_tool("set_status", "status", "Sets the status of the goal.", "such as Complete or Abandoned")
_PLAN = _field_tool(
    "set_plan", "plan", "Sets the steps that you still mean to take, which later pages show.", "steps in words, or none"
)
_GUIDE = _field_tool("guide", "guide", "Sets the place that you guide the car to.", "a place of the page, or none")
_CHANGE = _field_tool("change", "change", "Makes a change.", 'one of the choices under "You can change"')
_MESSAGE = _field_tool("message", "message", "Sets the message that goes with a change.", "the message")
_LOOK = ToolSpec(name=LOOK, description="Shows the page again, without time passing.")
_WAIT = ToolSpec(
    name=WAIT,
    description="Carries out what you have chosen, and lets time pass until something happens.",
    argument=_SECONDS,
    meaning="longest time to wait [s]; usually 10",
)

TOOLS: Final[Mapping[Role, tuple[ToolSpec, ...]]] = MappingProxyType(
    {
        Role.PARTICIPANT: (_SAY, _GUIDE, _NOTE, _LOOK, _WAIT),
        Role.CO_WIZARD: (_SAY, _DRIVE, _GOAL, _MARK, _STATUS, _PLAN, _NOTE, _LOOK, _WAIT),
        Role.AD_WIZARD: (_CHANGE, _MESSAGE, _NOTE, _LOOK, _WAIT),
    }
)
"""Tools by role."""


def waiting_label(seconds: Any, labels: Sequence[str]) -> str:
    """Returns the label of a time to wait: the longest one that is not above it, or else the shortest.

    Args:
        seconds: number, or text of one; None for the usual time.
        labels: times in seconds; the first one is usual.

    Raises:
        ValueError: it is no finite number.
    """
    if seconds is None or seconds == "":
        return labels[0]
    try:
        wanted = float(seconds)
    except (TypeError, ValueError, OverflowError):
        wanted = math.nan
    if not math.isfinite(wanted):
        raise ValueError(f"{_SECONDS} is {short_repr(seconds)}; it must be a number of seconds")
    times = sorted(labels, key=float)
    return next((label for label in reversed(times) if float(label) <= wanted), times[0])
