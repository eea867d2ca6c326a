"""Traffic lights for imported maps that have none: `FILE.xodr,lights=default`."""

from __future__ import annotations

import enum
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.errors import TownError, did_you_mean
from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.model import Lane, LaneLink, Signal, SignalKind
from dorothie_gym.maps.right_of_way import FACING, opposition, turn_into
from dorothie_gym.maps.town import Town
from dorothie_gym.maps.traffic_light_programs import derive_programmes
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.maps.import_notes import ImportNotes

FEWEST_APPROACHES: Final = 3
"""Fewest approaches of a junction with lights."""

MAIN_LANES: Final = 2
"""Fewest lanes of the two approaches that must cross for lights, as in Warrant 1 of MUTCD 2009, section 4C.02, whose
larger volumes are those of approaches with two or more lanes."""

FASTEST: Final = 90.0 / 3.6
"""Highest speed limit of an approach to a junction with lights [m/s]: 55 mph, beyond which roads are motorways."""

HEIGHT, ASIDE, APART = 3.0, 1.0, 0.9
"""Height of the lights [m], distance from the edge of the lane at the kerb, and between two lights there [m]."""

_SIGNS: Final = (SignalKind.STOP, SignalKind.YIELD)
_KEY: Final = "lights"


class Lights(enum.StrEnum):
    """Source of the traffic lights of an imported map."""

    MAP = "map"
    """The map file: a map without signals has no lights."""
    DEFAULT = "default"
    """The map file, or if it has none, junctions where main roads cross."""


@dataclass(frozen=True)
class _Approach:
    """Lanes of a road that lead into a junction, the outermost one first, and their links into it."""

    lanes: tuple[Lane, ...]
    links: tuple[LaneLink, ...]

    @property
    def is_main(self) -> bool:
        return len(self.lanes) >= MAIN_LANES

    def crosses(self, other: _Approach) -> bool:
        """Returns whether two approaches neither face each other nor merge side by side."""
        return bool(FACING <= opposition(_ending(self.lanes[0]), _ending(other.lanes[0])) <= np.pi - FACING)


def _ending(lane: Lane) -> Lane:
    """Returns the last piece of a lane, whose heading is that of the lane at its end."""
    return Lane(
        id=lane.id,
        road_id=lane.road_id,
        lane_id=lane.lane_id,
        junction_id=lane.junction_id,
        points=lane.points[-2:],
        widths=lane.widths[-2:],
        speed_limit=lane.speed_limit,
    )


def split_lights(name: str) -> tuple[str, Lights]:
    """Returns the file in a town's name, and the source of its lights: `Town05.xodr,lights=default` has an option.

    Raises:
        TownError: there is no such source.
    """
    file, comma, value = name.rpartition(f",{_KEY}=")
    if not comma:
        return name, Lights.MAP
    members = [str(member) for member in Lights]
    if value not in members:
        reason = f"{_KEY} is {value!r}; {did_you_mean(value, members)}known are {', '.join(members)}"
        raise TownError(name, "town", reason)
    return file, Lights(value)


def named_with(name: str, lights: Lights) -> str:
    """Returns the name of a town or file with the source of its lights, if that is not the map."""
    return name if lights is Lights.MAP else f"{name},{_KEY}={lights}"


def with_default_lights(town: Town, notes: ImportNotes) -> Town:
    """Returns a town with traffic lights where main roads cross; the town itself if it has lights, or needs none.

    A junction gets lights if it has at least `FEWEST_APPROACHES`, two of them with `MAIN_LANES` or more cross, and
    none is faster than `FASTEST`. Each approach has a light at the kerb, and another for lanes that only turn across
    oncoming traffic. Stop and yield signs of these approaches are left out. The programmes are those of other maps
    without programmes (`derive_programmes`).

    Args:
        town: town of a map.
        notes: receives what is assumed.
    """
    if any(signal.kind is SignalKind.TRAFFIC_LIGHT for signal in town.signals):
        notes.assumed(NoteKind.SIGNAL, "lights=default", "no lights are added: the map has traffic lights of its own")
        return town
    chosen = {number: approaches for number, approaches in _approaches(town).items() if deserves_lights(approaches)}
    if not chosen:
        notes.assumed(NoteKind.SIGNAL, "lights=default", "no lights are added: no main roads cross at a junction")
        return town
    first = max((signal.id for signal in town.signals), default=-1) + 1
    added: list[Signal] = []
    for number, approaches in chosen.items():
        before = len(added)
        for approach in approaches:
            added += _signals(town, approach, first + len(added))
        message = f"{len(added) - before} traffic lights by default for {len(approaches)} approaches"
        notes.assumed(NoteKind.SIGNAL, f"junction {number}", message)
    lit = {lane for signal in added for lane in signal.lanes}
    kept = [row for row in town.signals if row.kind not in _SIGNS or not row.lanes or not lit.issuperset(row.lanes)]
    signals = (*kept, *added)
    return Town(
        name=named_with(town.name, Lights.DEFAULT),
        lanes=town.lanes,
        links=town.links,
        junctions=town.junctions,
        streets=town.streets,
        sites=town.sites,
        signals=signals,
        crosswalks=town.crosswalks,
        sidewalks=town.sidewalks,
        programmes=derive_programmes(town.lanes, town.links, town.junctions, signals, town.traffic),
        traffic=town.traffic,
        cruise=town.cruise,
        titled=town.titled,
    )


def deserves_lights(approaches: Sequence[_Approach]) -> bool:
    """Returns whether a junction of these approaches gets lights by default."""
    if len(approaches) < FEWEST_APPROACHES:
        return False
    if any(lane.speed_limit > FASTEST for approach in approaches for lane in approach.lanes):
        return False
    return any(one.crosses(other) for one, other in combinations([row for row in approaches if row.is_main], 2))


def _approaches(town: Town) -> dict[int, list[_Approach]]:
    """Returns the approaches of each junction, in the order of the junctions."""
    entering: defaultdict[int, defaultdict[tuple[int, bool], list[LaneLink]]]
    entering = defaultdict(lambda: defaultdict(list))
    for link in town.links:
        source, target = town.lanes[link.source], town.lanes[link.target]
        if target.in_junction and not source.in_junction and not link.type.is_lane_change:
            entering[target.junction_id][source.road_id, source.lane_id < 0].append(link)
    found: dict[int, list[_Approach]] = {}
    for junction in town.junctions:
        found[junction.id] = []
        for links in entering[junction.id].values():
            lanes = {link.source: town.lanes[link.source] for link in links}
            outwards = sorted(lanes.values(), key=lambda lane: -abs(lane.lane_id))
            found[junction.id].append(_Approach(tuple(outwards), tuple(links)))
    return found


def _signals(town: Town, approach: _Approach, number: int) -> list[Signal]:
    """Returns the lights of an approach, with ids that count up from a number."""
    onward = {lane.id: [link for link in approach.links if link.source == lane.id] for lane in approach.lanes}
    turning = [
        lane.id
        for lane in approach.lanes
        if all(town.traffic.crosses_oncoming(turn_into(link, town.lanes)) for link in onward[lane.id])
    ]
    through = [lane.id for lane in approach.lanes if lane.id not in turning]
    groups = [tuple(sorted(group)) for group in (through, turning) if group]
    kerb = approach.lanes[0]
    heading = wrap_radians(float(kerb.headings[-1]) + np.pi)
    signals = []
    for k, lanes in enumerate(groups):
        aside = town.traffic.sign * (kerb.widths[-1] / 2.0 + ASIDE + k * APART)
        x, y = kerb.position(kerb.length, aside).tolist()
        position = (x, y, float(kerb.points[-1, 2]) + HEIGHT)
        light = SignalKind.TRAFFIC_LIGHT
        signals.append(Signal(id=number + k, kind=light, position=position, heading=heading, lanes=lanes))
    return signals
