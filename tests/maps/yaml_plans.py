"""Town files for tests of layouts and compiled towns."""

import math
from collections.abc import Mapping
from pathlib import Path

from dorothie_gym.maps.model import LinkType
from dorothie_gym.maps.town import Town
from dorothie_gym.maps.yaml import read_yaml_town
from dorothie_gym.maps.yaml.layout import Layout, lay_out
from dorothie_gym.maps.yaml.schema import read_plan

AVENUES = """\
speed: 50
junctions: {cross: [0, 0], west: [-150, 0], east: [150, 0], north: [0, -150], south: [0, 150]}
streets:
  Avenue: {through: [west, cross, east], lanes: 3, median: 4, turn_lanes: [cross], speed: 60}
  Lane: {through: [north, cross, south], lanes: [2, 1]}
  Loop: {through: [north, [150, -150], east, [150, 150], south, [-150, 150], west, [-150, -150], north], radius: 60}
lights:
  - at: cross
    offset: 7
    phases: [{green: [Avenue], seconds: 20}, {left: [Avenue], seconds: 8}, {green: [Lane], seconds: 10}]
stops: [[north, Lane]]
yields: [[west, Avenue]]
crosswalks: [[cross, Avenue]]
sites: [[70, 22], [20, 80]]
"""
"""A crossroads with turn lanes and lights within a ring."""

CIRCUS = """\
junctions: {circus: {at: [0, 0], roundabout: 30, lanes: 2}, n: [0, -150], e: [150, 0], s: [0, 150], w: [-150, 0]}
streets:
  Avenue: {through: [w, circus, e], lanes: 2, median: 2}
  Lane: {through: [n, circus, s]}
  Loop: {through: [n, [150, -150], e, [150, 150], s, [-150, 150], w, [-150, -150], n], radius: 40}
"""
"""A roundabout of two lanes with arms of two lanes and of one."""

PAIR = """\
junctions: {nw: [0, 0], ne: [200, 0], sw: [0, 90], se: [200, 90], n: [100, 0], s: [100, 90]}
streets:
  King Street: {through: [ne, n, nw], one_way: true, lanes: 2}
  Queen Street: {through: [sw, s, se], one_way: true, lanes: 2}
  West: {through: [nw, sw], one_way: true, lanes: 2}
  East: {through: [se, ne], one_way: true, lanes: 2}
  Mid: [n, s]
"""
"""A one-way ring, counter-clockwise, with a two-way street across."""

INTERCHANGE = """\
junctions: {hw: [-300, 0], he: [300, 0], west: [-600, 0], east: [600, 0], ts: [0, 80, 6], tn: [0, -80, 6]}
streets:
  Highway: {through: [west, hw, he, east], lanes: 2, median: 4, sidewalk: 0, speed: 90}
  Bridge: {through: [tn, [0, -30, 6], [0, 30, 6], ts]}
  Off East: {through: [hw, [-210, 32], [-120, 80], ts], ramp: true, speed: 60}
  On East: {through: [ts, [120, 80], [210, 32], he], ramp: true, speed: 60}
  Off West: {through: [he, [210, -32], [120, -80], tn], ramp: true, speed: 60}
  On West: {through: [tn, [-120, -80], [-210, -32], hw], ramp: true, speed: 60}
  North: {through: [west, [-600, -220], [0, -220], tn], radius: 40}
  South: {through: [east, [600, 220], [0, 220], ts], radius: 40}
  Ring: {through: [west, [-700, 0], [-700, 400], [700, 400], [700, 0], east], radius: 40}
"""
"""A diamond interchange: ramps from a highway up to a bridge over it."""

TIGHT_RAMPS = """\
junctions: {west: [-250, 0], node: [0, 0], east: [250, 0], on: [-200, 210], off: [200, 210]}
streets:
  Highway: {through: [west, node, east], lanes: 2, median: 4, sidewalk: 0}
  Off: {through: [node, [120, 115], off], ramp: true}
  On: {through: [on, [-120, 115], node], ramp: true}
  Loop: {through: [west, [-250, -200], [250, -200], east, [250, 210], off, on, [-250, 210], west]}
"""
"""A highway with an off-ramp and an on-ramp at one node, both at 44 degrees."""


def star(arms: Mapping[int, str], radius: float = 200.0) -> str:
    """A town file with one junction, "hub", in the middle of a loop.

    Args:
        arms: what is said of each street, by its direction clockwise from east [degrees], in order.
        radius: of the loop [m].
    """

    def place(direction: float) -> str:
        angle = math.radians(direction)
        return f"[{radius * math.cos(angle):.2f}, {radius * math.sin(angle):.2f}]"

    streets, loop, directions = [], [], list(arms)
    for here, after in zip(directions, [*directions[1:], directions[0] + 360], strict=True):
        said = f", {arms[here]}" if arms[here] else ""
        streets.append(f"  Arm {here}: {{through: [hub, t{here}]{said}}}")
        bends = math.ceil((after - here) / 60.0)
        loop += [f"t{here}", *(place(here + (after - here) * k / bends) for k in range(1, bends))]
    tips = [f"  t{direction}: {place(direction)}" for direction in directions]
    loop.append(loop[0])
    return "\n".join(
        ["junctions:", "  hub: [0, 0]", *tips, "streets:", *streets, f"  Loop: {{through: [{', '.join(loop)}]}}", ""]
    )


def laid_out(folder: Path, text: str) -> Layout:
    """The layout of a town file."""
    return lay_out(read_plan(_file(folder, text)))


def compiled(folder: Path, text: str) -> Town:
    """The town of a town file."""
    return read_yaml_town(_file(folder, text))


def _file(folder: Path, text: str) -> Path:
    path = folder / "town.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def street_of(town: Town, lane: int) -> str:
    """Name of a lane's street, or an empty text."""
    number = town.lanes[lane].street
    return town.streets[number].name if number >= 0 else ""


def ways(town: Town, source: str, target: str, type_: LinkType | None = None) -> list[tuple[int, int]]:
    """Numbers of the lanes that junctions lead from one street into another, sorted: (from, to)."""
    found = set()
    for lane in town.lanes:
        if not lane.in_junction and street_of(town, lane.id) == source:
            for link in town.successors(lane.id):
                if town.lanes[link.target].in_junction and (type_ is None or link.type is type_):
                    exit_ = town.lanes[town.successors(link.target)[0].target]
                    if street_of(town, exit_.id) == target:
                        found.add((abs(lane.lane_id), abs(exit_.lane_id)))
    return sorted(found)
