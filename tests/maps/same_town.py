"""Bitwise comparison of towns, and a town with every kind of element."""

from __future__ import annotations

import dataclasses
import struct
from typing import Any

import numpy as np

from dorothie_gym.maps import (
    Crosswalk,
    Junction,
    Lane,
    LaneLink,
    LightPhase,
    LightProgramme,
    LinkType,
    Sidewalk,
    Signal,
    SignalKind,
    Site,
    Street,
    Town,
)
from dorothie_gym.maps.cache import PARTS


def bits(value: Any) -> Any:
    """Converts a value to a form that is equal only if all bits, shapes and types are equal."""
    if dataclasses.is_dataclass(value):
        return type(value).__name__, [(f.name, bits(getattr(value, f.name))) for f in dataclasses.fields(value)]
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    if isinstance(value, np.generic):
        return bits(value.item())
    if isinstance(value, float):
        return struct.pack("<d", value)
    if isinstance(value, tuple):
        return [bits(item) for item in value]
    return type(value).__name__, value


def town_bits(town: Town) -> Any:
    return town.name, bits(town.cruise), town.titled, {part: bits(getattr(town, part)) for part in PARTS}


def town_with_everything() -> Town:
    """Returns a town with every kind of element, and with numbers that are sensitive to rounding."""
    ahead = np.array([[0.1 + 0.2, -0.0, 1e-300], [30.0, 1 / 3, 2.5], [60.0, np.pi, 5.0]])
    lanes = [
        Lane(id=0, road_id=3, lane_id=-1, points=ahead, widths=np.array([3.5, 3.4, 0.1]), speed_limit=50 / 3.6),
        Lane(
            id=1,
            road_id=np.int64(4),  # type: ignore[arg-type]  # a NumPy number instead of a Python one on purpose
            lane_id=2,
            junction_id=8,
            points=ahead[1:] + 60.0,
            widths=np.full(2, 3.0),
            speed_limit=float(np.nextafter(10.0, 11.0)),
            street=0,
        ),
    ]
    phases = (LightPhase(duration=20.1, green=(70, 71)), LightPhase(duration=0.1, yellow=(70,)), LightPhase(duration=3))
    return Town(
        name="naïve ville",
        lanes=lanes,
        links=[LaneLink(0, 1, LinkType.LEFT), LaneLink(1, 0, LinkType.LANE_CHANGE_RIGHT)],
        junctions=[
            Junction(id=8, position=(0.1, -0.2), connectors=(1,)),
            Junction(id=9, position=(1, 2), connectors=()),
        ],
        streets=[Street(id=0, name="Straße «Nord»", lanes=(0, 1)), Street(id=1, name="", lanes=())],
        sites=[Site(id=0, lane=0, station=0.7, position=(1.1, 2.2), waypoint=(3.3, 4.4), street=-1)],
        signals=[
            Signal(id=70, kind=SignalKind.TRAFFIC_LIGHT, position=(1.0, 2.0, 0.3), heading=-3.1, lanes=(0, 1)),
            Signal(id=71, kind=SignalKind.SPEED, position=(np.float64(1.5), 2.0, 0.0), heading=0.1, value=30 / 3.6),
        ],
        crosswalks=[Crosswalk(id=0, outline=np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]]))],
        sidewalks=[Sidewalk(id=0, points=ahead[:2].copy(), width=2.1, street=0)],
        programmes=[LightProgramme(junction_id=8, signals=(70, 71), phases=phases, offset=0.3)],
    )
