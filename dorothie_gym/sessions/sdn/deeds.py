"""What is done in SDN's logs: physical actions and updates of beliefs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from dorothie_gym.ontology import (
    LANE_SWITCH_LEFT,
    LANE_SWITCH_RIGHT,
    ArgumentKind,
    MentalAction,
    OntologyError,
    PhysicalAction,
    parse_goal_status,
    parse_landmark,
    parse_mental_action,
    parse_physical_action,
)
from dorothie_gym.sessions.report import ReadReport
from dorothie_gym.sessions.sdn.rows import Row, number_of, plain, whole_of

RIGHT: Final = 2
"""Value of a LaneSwitch to the right; 1 and 3 are left (spec: sdn-format)."""

LEFT: Final = 3
"""Value of a LaneSwitch to the left that we write: the published code makes +90 degrees of it."""

_ON: Final = {"on": True, "off": False, "true": True, "false": False, "1": True, "0": False}


@dataclass
class DeedReader:
    """Turns the values of rows into the data of actions and beliefs.

    Attributes:
        report: is told what is unknown.
        lane_switches: which values of LaneSwitch occurred, and how often.
        roads: of JTurns that name a road: number of the JTurn, counted from 0, and the road.
        turns: number of JTurns read so far.
    """

    report: ReadReport
    lane_switches: Counter[str] = field(default_factory=Counter)
    roads: dict[int, int] = field(default_factory=dict)
    turns: int = 0

    def physical(self, val: Row) -> dict[str, Any]:
        """Returns the data of a physical action, a JTurn's angle as the file has it.

        Raises:
            OntologyError: the action is unknown.
        """
        name = val.get("act")
        number = whole_of(name) if not isinstance(name, str) or name.isdecimal() else None
        if number is not None and number in PhysicalAction._value2member_map_:
            action = PhysicalAction(number)
        else:
            action = parse_physical_action(str(name))
        angle: float | None = None
        up: bool | None = None
        kind, value = action.argument, val.get("slot_val")
        if kind is ArgumentKind.ANGLE:
            angle = self._turn(val)
        elif kind is ArgumentKind.SIDE:
            angle = self._side(value)
        elif kind is ArgumentKind.SPEED_STEP:
            step = number_of(value)
            up = None if not step else step > 0
        elif kind is ArgumentKind.SWITCH:
            up = value if isinstance(value, bool) else _ON.get(str(value).strip().casefold())
        if kind is not ArgumentKind.NONE and angle is None and up is None:
            self.report.miss(f"argument of {action.label}")
        return {"action": action.label, "angle": angle, "up": up}

    def belief(self, val: Row) -> dict[str, Any]:
        """Returns the data of a belief update; arguments that are not understood are kept beside it.

        Raises:
            OntologyError: the update is unknown.
        """
        action = parse_mental_action(str(val.get("act")))
        value = val.get("slot_val")
        arguments: dict[str, Any] | None = {}
        if action is MentalAction.PLAN_UPDATE:
            arguments = plan_of(value)
        elif action is MentalAction.GOAL_UPDATE:
            arguments = goals_of(value)
        elif action is MentalAction.STATUS_UPDATE:
            arguments = _status_of(value)
        elif action is MentalAction.KNOWLEDGE_UPDATE:
            arguments = _guess_of(value)
        if arguments is None:
            self.report.keep(f"argument of {action.label}")
            return {"action": action.label, "sdn": plain(dict(val))}
        return {"action": action.label, **arguments}

    def _turn(self, val: Row) -> float | None:
        turn = self.turns
        self.turns += 1
        value = val.get("slot_val")
        if str(val.get("slot_type")).strip().casefold() == "roadid":
            road = whole_of(value)
            if road is not None:
                self.roads[turn] = road
            return None
        angle = number_of(value)
        return None if angle is None else (angle + 180.0) % 360.0 - 180.0

    def _side(self, value: Any) -> float | None:
        number = whole_of(value)
        self.lane_switches[str(value)[:20]] += 1
        if number is None or number not in (1, RIGHT, LEFT):
            return None
        return LANE_SWITCH_RIGHT if number == RIGHT else LANE_SWITCH_LEFT


def plan_of(value: Any) -> dict[str, Any] | None:
    """Returns the junctions of a plan; None where the value holds none."""
    items = value if isinstance(value, list) else [value]
    junctions = [whole_of(item) for item in items]
    return None if None in junctions else {"junctions": junctions}


def goals_of(value: Any) -> dict[str, Any] | None:
    """Returns the landmarks of goals; None where the value holds none."""
    items = value if isinstance(value, list) else [value]
    try:
        return {"landmarks": [parse_landmark(item).label for item in items]}
    except OntologyError:
        return None


def _status_of(value: Any) -> dict[str, Any] | None:
    if isinstance(value, Mapping):
        value = [value.get("landmark"), value.get("status")]
    if not isinstance(value, list) or len(value) != 2:
        return None
    try:
        return {"landmark": parse_landmark(value[0]).label, "status": parse_goal_status(value[1]).label}
    except OntologyError:
        return None


def _guess_of(value: Any) -> dict[str, Any] | None:
    if isinstance(value, Mapping):
        landmark = value.get("landmark")
        value = [value.get("x"), value.get("y"), *([] if landmark is None else [landmark])]
    if not isinstance(value, list) or len(value) not in (2, 3):
        return None
    x, y = number_of(value[0]), number_of(value[1])
    if x is None or y is None:
        return None
    guess: dict[str, Any] = {"x": x, "y": y}
    if len(value) == 3 and isinstance(value[2], str):
        try:
            guess["landmark"] = parse_landmark(value[2]).label
        except OntologyError:
            return None
    return guess
