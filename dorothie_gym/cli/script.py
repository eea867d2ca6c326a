"""The events of a session as lines that a person reads, as in the script of a play."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from dorothie_gym.ontology import Role, parse_act
from dorothie_gym.recording import Event, EventType

SPEAKERS: Mapping[Role, tuple[str, str]] = {
    Role.PARTICIPANT: ("Participant", "bold cyan"),
    Role.CO_WIZARD: ("Co-Wizard", "bold blue"),
    Role.AD_WIZARD: ("Ad-Wizard", "bold magenta"),
    Role.AGENT: ("Car", "bold yellow"),
}
"""What each role is called, and the style of its name."""


@dataclass(frozen=True, kw_only=True)
class ScriptLine:
    """One line of the script.

    Attributes:
        time: when [s].
        speaker: whose line it is.
        text: what is said, or what happens.
        style: of the text.
        acts: dialogue acts in short; empty for what is not speech.
    """

    time: float
    speaker: Role
    text: str
    style: str = ""
    acts: str = ""


def script_lines(events: Iterable[Event], task: Callable[[int], str]) -> list[ScriptLine]:
    """Returns the lines for the events of a decision; events that are of no interest to a spectator have none.

    Args:
        events: what happened.
        task: the words of a subgoal, by its number.
    """
    lines: list[ScriptLine] = []
    last: int | None = None
    for event in events:
        if event.type is not EventType.DIALOGUE_MOVE:
            if event.type is EventType.SUBGOAL:
                text, style = _subgoal(event.data, task(event.data["subgoal"]))
                lines.append(ScriptLine(time=event.time, speaker=event.source, text=text, style=style))
            elif (describe := _DESCRIBED.get(event.type)) is not None:
                text, style = describe(event.data)
                lines.append(ScriptLine(time=event.time, speaker=event.source, text=text, style=style))
            continue
        act = str(parse_act(event.data["move"], event.data["slots"])).removesuffix("()")
        if event.data["utterance"] == last:  # a further act of the words that stand there already
            before = lines.pop()
            act = f"{before.acts} {act}"
        last = event.data["utterance"]
        lines.append(ScriptLine(time=event.time, speaker=event.source, text=event.data["text"], acts=act))
    return lines


def _message(data: Mapping[str, Any]) -> tuple[str, str]:
    return f"“{data['text']}”", "magenta"


def _physical(data: Mapping[str, Any]) -> tuple[str, str]:
    text = str(data["action"])
    if data["angle"] is not None:
        side = "left" if data["angle"] > 0 else "right"
        text += f" {abs(data['angle'])}° {side}" if data["angle"] else " straight on"
    elif data["up"] is not None:
        text += (" up" if data["up"] else " down") if text == "SpeedChange" else (" on" if data["up"] else " off")
    return text, "dim"


def _exception(data: Mapping[str, Any]) -> tuple[str, str]:
    kind = data["kind"].replace("_", " ")
    details = {
        "weather": lambda: f"{data['parameter']} becomes {data['value']:g}",
        "spawn_vehicles": lambda: f"{data['count']} appear",
        "spawn_pedestrians": lambda: f"{data['count']} appear",
        "place_prop": lambda: f"{data['prop']} on the road",
        "move_prop": lambda: f"{data['prop']} stands elsewhere",
        "delete_prop": lambda: f"{data['prop']} is gone",
        "sensor_fault": lambda: f"{data['sensor']} {'begins' if data['on'] else 'is over'}",
    }
    detail = details.get(data["kind"], lambda: str(data["landmark"]))()
    return f"{kind}: {detail}", "magenta"


def _hazard(data: Mapping[str, Any]) -> tuple[str, str]:
    return f"stops for a hazard {data['distance']:.0f} m ahead: {data['reason']}", "yellow"


def _collision(data: Mapping[str, Any]) -> tuple[str, str]:
    fault = "its own fault" if data["own_fault"] else "not its fault"
    return f"collides at {data['speed'] * 3.6:.0f} km/h: {data['other']} ({fault})", "bold red"


def _breach(text: str) -> Callable[[Mapping[str, Any]], tuple[str, str]]:
    return lambda data: (text, "bold red")


def _subgoal(data: Mapping[str, Any], task: str) -> tuple[str, str]:
    status = data["status"]
    if status == "Complete":
        return f"arrives. Done: {task}", "bold green"
    return f"{'No longer' if status == 'Abandoned' else 'Now'}: {task}", "magenta"


_DESCRIBED: Mapping[EventType, Callable[[Mapping[str, Any]], tuple[str, str]]] = {
    EventType.MESSAGE: _message,
    EventType.PHYSICAL_ACTION: _physical,
    EventType.EXCEPTION: _exception,
    EventType.HAZARD_STOP: _hazard,
    EventType.COLLISION: _collision,
    EventType.RED_LIGHT: _breach("runs a red light"),
    EventType.STOP_SIGN: _breach("passes a stop sign without standing"),
    EventType.OFF_ROAD: _breach("leaves the road"),
    EventType.WRONG_WAY: _breach("drives against the traffic"),
}
