"""The events of a session as rows of SDN's release layout."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from dorothie_gym.ontology import (
    SPEED_STEP,
    ArgumentKind,
    ExceptionKind,
    MentalAction,
    Role,
    parse_mental_action,
    parse_physical_action,
    parse_prop,
)
from dorothie_gym.ontology.vocabulary import OntologyError
from dorothie_gym.sessions.events import Event, EventType
from dorothie_gym.sessions.sdn.deeds import LEFT, RIGHT
from dorothie_gym.sessions.sdn.layouts import FRAMES_EACH, MORE, OURS, SDN_RATE
from dorothie_gym.sessions.sdn.log import FOREIGN
from dorothie_gym.sessions.session import Session

_ACT: Final = ("move", "slots", "exchange", "transaction", "span", "utterance", "start", "end")
_SAID: Final = (*_ACT, "text", "recognised", "sdn", "sdn_act")
_TO: Final = {Role.PARTICIPANT: Role.CO_WIZARD, Role.CO_WIZARD: Role.PARTICIPANT}
_BELIEFS: Final = {
    MentalAction.PLAN_UPDATE: ("PlanUpdate", "Junction"),
    MentalAction.GOAL_UPDATE: ("GoalUpdate", "Landmark"),
    MentalAction.STATUS_UPDATE: ("StatusUpdate", "Status"),
    MentalAction.KNOWLEDGE_UPDATE: ("LandmarkUpdate", "Location"),
    MentalAction.OTHER: ("Other", None),
}
_PLAN_CLOSED: Final = ("Complete", "Abandoned")


def log_rows(session: Session, first: int) -> list[dict[str, Any]]:
    """Returns the rows of `annotated_log.json`: every event, and a row for each frame of speech, by frame.

    Args:
        session: the session.
        first: frame (10 Hz) that it begins at.
    """
    rows = [_row(event, first) for event in session.events]
    return sorted([*_speech(session, first), *rows], key=lambda row: int(row["frame"]))


def plan_rows(session: Session, first: int) -> Iterator[dict[str, Any]]:
    """Yields the rows of `plan.json`: `Ongoing` opens a goal, the next row of the landmark closes it."""
    opened: set[str] = set()
    since = first
    for event in session.of_type(EventType.SUBGOAL):
        landmark, status = str(event.data.get("landmark")), str(event.data.get("status"))
        frame = _frame(event, first)
        if status in _PLAN_CLOSED and landmark not in opened:
            yield {"frame": since, "landmark": landmark, "status": "Ongoing"}
        yield {"frame": frame, "landmark": landmark, "status": status}
        opened = opened | {landmark} if status == "Ongoing" else opened - {landmark}
        if status in _PLAN_CLOSED:
            since = frame


def detailed_plan_rows(session: Session, first: int) -> Iterator[dict[str, Any]]:
    """Yields the rows of `detailed_plan.json`: plans and goals as the Co-Wizard said that it believes in them."""
    for event in session.of_type(EventType.BELIEF_UPDATE):
        junctions, landmarks = event.data.get("junctions"), event.data.get("landmarks")
        if junctions is not None or landmarks is not None:
            yield {"frame": _frame(event, first), "junctions": junctions, "objective": landmarks}


def ad_wizard_lines(session: Session, first: int) -> Iterator[str]:
    """Yields the lines of `ad_wizardlog.csv`; its time is that of the session, no clock's."""
    props = 0
    for event in session.of_type(EventType.EXCEPTION, EventType.MESSAGE):
        data = event.data
        values: list[Any] | None = None
        if event.type is EventType.MESSAGE:
            values = ["message", " ".join(str(data.get("text")).split())]
        elif data.get("kind") == ExceptionKind.WEATHER.name.lower():
            values = ["set_weather", data.get("parameter"), data.get("value")]
        elif data.get("kind") == ExceptionKind.PLACE_PROP.name.lower():
            values = ["prop_create", _blueprint(data.get("prop")), props, data.get("x", 0.0), data.get("y", 0.0)]
            values += [data.get(name, 0.0) for name in ("z", "pitch", "yaw", "roll")]
            props += 1
        elif data.get("kind") in ("spawn_pedestrians", "spawn_vehicles"):
            name = "make_peds" if data["kind"] == "spawn_pedestrians" else "make_cars"
            values = [name, data.get("count"), *(data.get(corner, 0.0) for corner in ("x0", "x1", "y0", "y1"))]
        if values is not None:
            frame = _frame(event, first)
            yield ", ".join(str(value) for value in (f"{frame / SDN_RATE:.1f}", frame, *values))


def _row(event: Event, first: int) -> dict[str, Any]:
    row: dict[str, Any] = {"frame": _frame(event, first), "type": event.type.value, "from": event.source.sdn_names[0]}
    to = _TO.get(event.source) if event.type is EventType.DIALOGUE_MOVE else None
    row |= {"to": to.sdn_names[0] if to is not None else None, "flag": event.flagged}
    data = event.data
    if event.type is EventType.DIALOGUE_MOVE:
        row |= _said(data)
    elif event.type is EventType.PHYSICAL_ACTION:
        row["val"] = _physical(data)
    elif event.type is EventType.BELIEF_UPDATE and _is_belief(data):
        row["val"] = _belief(data)
    elif event.type is EventType.OTHER and event.type_name.startswith(FOREIGN):
        return {**data, "frame": row["frame"], "type": event.type_name.removeprefix(FOREIGN)}
    else:
        extra = {name: value for name, value in event.extra.items() if name != "type"}
        return {**row, "type": event.type_name, "val": dict(data), OURS: {"extra": extra} if extra else {}}
    if isinstance(data.get("sdn"), Mapping):
        row |= {name: value for name, value in data["sdn"].items() if name not in row}
    return {**row, MORE: dict(event.extra)} if event.extra else row


def _said(data: Mapping[str, Any]) -> dict[str, Any]:
    act = {name: data[name] for name in _ACT if name in data}
    if isinstance(data.get("sdn_act"), Mapping):
        act = {**data["sdn_act"], **act}
    act |= _more(data, _SAID)
    said = {"utterance_gt": data["text"], "utterance_filename": _file(data), "act": act}
    return said if data.get("recognised") is None else {**said, "utterance": data["recognised"]}


def _file(data: Mapping[str, Any]) -> str:
    return str(data.get("audio") or f"utterance_{data['utterance']}.flac")


def _physical(data: Mapping[str, Any]) -> dict[str, Any]:
    action = parse_physical_action(data["action"])
    kind, angle, up = action.argument, data.get("angle"), data.get("up")
    slot: tuple[str | None, Any] = (None, None)
    if kind is ArgumentKind.ANGLE:
        slot = ("Angle", angle) if angle is not None or "road" not in data else ("RoadID", data["road"])
    elif kind is ArgumentKind.SIDE and angle is not None:
        slot = ("Direction", LEFT if angle > 0 else RIGHT)
    elif kind is ArgumentKind.SPEED_STEP and up is not None:
        slot = ("Speed", SPEED_STEP if up else -SPEED_STEP)
    elif kind is ArgumentKind.SWITCH and up is not None:
        slot = ("Light", "On" if up else "Off")
    carried = {ArgumentKind.ANGLE: "angle", ArgumentKind.SIDE: "angle"}.get(kind, "up")
    unusual = [name for name in ("angle", "up") if name != carried and data.get(name) is not None]
    more = _more(data, {"action", "angle", "up", "sdn"} - set(unusual))
    return {"act": action.label, "slot_type": slot[0], "slot_val": slot[1], **more}


def _is_belief(data: Mapping[str, Any]) -> bool:
    """Whether the layout has a form for a belief update."""
    try:
        action = parse_mental_action(str(data.get("action")))
    except OntologyError:
        return False
    return all(name in data for name in action.arguments)


def _belief(data: Mapping[str, Any]) -> dict[str, Any]:
    action = parse_mental_action(str(data["action"]))
    name, slot_type = _BELIEFS[action]
    known = ["action", "sdn", *action.arguments]
    values = [data[argument] for argument in action.arguments]
    value: Any = values
    if action in (MentalAction.PLAN_UPDATE, MentalAction.GOAL_UPDATE):
        value = values[0]
    elif action is MentalAction.KNOWLEDGE_UPDATE and isinstance(data.get("landmark"), str):
        value = [*values, data["landmark"]]
        known.append("landmark")
    elif action is MentalAction.OTHER:
        value = None
    return {"act": name, "slot_type": slot_type, "slot_val": value, **_more(data, known)}


def _more(data: Mapping[str, Any], known: Any) -> dict[str, Any]:
    rest = {name: value for name, value in data.items() if name not in known}
    return {MORE: rest} if rest else {}


def _speech(session: Session, first: int) -> Iterator[dict[str, Any]]:
    for utterance in session.utterances():
        data = session.events[utterance.moves[0].index].data
        start, end = round(utterance.start * SDN_RATE), round(utterance.end * SDN_RATE)
        for frame in range(max(start, 0), max(end, start, 0) + 1):
            yield {
                "frame": frame + first,
                "type": "Speech",
                "from": utterance.speaker.sdn_names[0],
                "utterance_filename": _file(data),
                "start_frame": max(start, 0) + first,
                "end_frame": max(end, start, 0) + first,
            }


def _blueprint(prop: Any) -> str:
    try:
        return parse_prop(str(prop)).blueprint
    except OntologyError:
        return str(prop)


def _frame(event: Event, first: int) -> int:
    return event.frame // FRAMES_EACH + first
