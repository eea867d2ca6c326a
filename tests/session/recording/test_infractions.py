from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import ObjectClass, Role
from dorothie_gym.session.recording import INFRACTIONS, Event, EventType, Session
from tests.session.recording.builders import write

PLACE = {"lane": 3, "station": 12.5, "x": 1.0, "y": -2.0}


def breach(kind: EventType, frame: int = 4, **changes: Any) -> Event:
    data: dict[str, Any] = {**PLACE, "key": None, "other": None}
    if kind is EventType.COLLISION:
        data |= {"key": 17, "other": "Vehicles", "own_fault": True, "speed": 3.5}
    elif kind in (EventType.RED_LIGHT, EventType.STOP_SIGN):
        data |= {"key": 5, "other": "TrafficLight" if kind is EventType.RED_LIGHT else "TrafficSign"}
    return Event(frame=frame, type=kind, source=Role.AGENT, data={**data, **changes})


def test_every_infraction_comes_back_with_place_and_counterpart(tmp_path: Path) -> None:
    events = [breach(kind, frame=k) for k, kind in enumerate(INFRACTIONS)]
    session = Session.load(write(tmp_path / "one", events, frames=40))
    assert list(session.events) == events
    assert [record.type for record in session.infractions] == list(INFRACTIONS)
    for k, record in enumerate(session.infractions):
        assert (record.index, record.frame) == (k, k)
        assert (record.lane, record.station, record.x, record.y) == (3, 12.5, 1.0, -2.0)
    collision, light, sign, off_road, wrong_way = session.infractions
    assert (collision.key, collision.other, collision.own_fault) == (17, ObjectClass.VEHICLES, True)
    assert (light.key, light.other) == (5, ObjectClass.TRAFFIC_LIGHT)
    assert sign.other is ObjectClass.TRAFFIC_SIGN
    assert (off_road.key, off_road.other, wrong_way.key) == (None, None, None)


def test_collisions_of_old_recordings_have_no_place(tmp_path: Path) -> None:
    old = {"other": "Static", "own_fault": False, "speed": 1.0}
    event = Event(frame=1, type=EventType.COLLISION, source=Role.AGENT, data=old)
    (record,) = Session.load(write(tmp_path / "one", [event], frames=40)).infractions
    assert (record.lane, record.x, record.key) == (None, None, None)
    assert record.other is ObjectClass.STATIC
    assert not record.own_fault


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [
        (EventType.RED_LIGHT, "lane", None),
        (EventType.OFF_ROAD, "x", "here"),
        (EventType.COLLISION, "own_fault", 1),
        (EventType.COLLISION, "other", "Spaceship"),
        (EventType.STOP_SIGN, "key", "first"),
    ],
)
def test_a_broken_infraction_is_refused_by_its_field(tmp_path: Path, kind: EventType, field: str, value: Any) -> None:
    with pytest.raises(SessionError, match=f"{kind.value}.*field '{field}'"):
        write(tmp_path / "one", [breach(kind, **{field: value})], frames=40)
