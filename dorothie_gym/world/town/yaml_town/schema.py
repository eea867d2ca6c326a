"""The town language: what a YAML town may say, read into a checked plan.

The whole language is told in docs/towns.md. What is checked here needs no geometry: keys, types, ranges, names, and
whether things that are named together go together; whether it all fits into its place is the layout's question.

A village::

    name: village                  # optional, else the file's name
    speed: 40                      # km/h, optional
    junctions:                     # metres, x east, y south
      green: [0, 0]
      pond: [150, 0]
    streets:                       # through junctions and plain points, which bend the street
      High Street: [green, pond]
      Mill Lane: {through: [green, [0, 90], [150, 90], pond], speed: 30, width: 3.25, radius: 30}
      Back Lane: [green, [0, -90], [150, -90], pond]
    lights: [green]
    crosswalks: [[pond, High Street]]
"""

from __future__ import annotations

from pathlib import Path

from dorothie_gym.world.town.yaml_town.geometry import Point
from dorothie_gym.world.town.yaml_town.nodes import Entry
from dorothie_gym.world.town.yaml_town.plan import Bend, JunctionPlan, RoundaboutPlan, TownPlan
from dorothie_gym.world.town.yaml_town.signs import read_crosswalks, read_lights, read_signs
from dorothie_gym.world.town.yaml_town.source import read_nodes
from dorothie_gym.world.town.yaml_town.streets import (
    StreetDefaults,
    lane_width,
    pavement,
    point,
    read_street,
    speed,
    told,
)

TOWN_KEYS = (
    "name", "speed", "width", "sidewalk", "junctions", "streets", "lights", "stops", "yields", "crosswalks", "sites",
)  # fmt: skip
JUNCTION_KEYS = ("at", "roundabout", "lanes", "speed")
ROUNDABOUT_SPEED = 30.0
"""Speed limit on a roundabout where none is given [km/h], if the town's own is not lower."""
ROUNDABOUT_RADIUS = (8.0, 150.0)
"""Radius of a ring's middle line [m]."""
ROUNDABOUT_LANES = (1, 3)


def read_plan(path: Path) -> TownPlan:
    """Reads a town file.

    Raises:
        TownError: with the file, the line, the element, and what to do.
    """
    top = read_nodes(path)
    fields = {key: value.named(key) for key, value in top.fields(TOWN_KEYS, required=("junctions", "streets")).items()}
    defaults = StreetDefaults()
    for key, read in (("speed", speed), ("width", lane_width), ("sidewalk", pavement)):
        if key in fields:
            defaults = defaults.replaced(key, read(fields[key]))
    junctions = _junctions(fields["junctions"], defaults)
    streets = tuple(
        read_street(k, key, value, junctions, defaults)
        for k, (key, value) in enumerate(fields["streets"].items("streets by name, each a list of junctions"))
    )
    if not streets:
        fields["streets"].fail("there is no street; add one")
    lights = read_lights(fields["lights"], junctions, streets) if "lights" in fields else ()
    stops, yields = read_signs(fields.get("stops"), fields.get("yields"), junctions, streets, lights)
    return TownPlan(
        name=fields["name"].text("a name") if "name" in fields else path.stem,
        junctions=junctions,
        streets=streets,
        lights=lights,
        stops=stops,
        yields=yields,
        crosswalks=read_crosswalks(fields["crosswalks"], junctions, streets) if "crosswalks" in fields else (),
        sites=_sites(fields["sites"]) if "sites" in fields else (),
    )


def _junctions(entry: Entry, defaults: StreetDefaults) -> dict[str, JunctionPlan]:
    junctions: dict[str, JunctionPlan] = {}
    for k, (key, value) in enumerate(entry.items("junctions by name, each [x, y]")):
        name = key.text("a name")
        here = key.named(f"junction {name!r}")
        place, roundabout = _junction(value.named(here.element), defaults)
        height = place.height or 0.0
        for other in junctions.values():
            if (other.centre, other.height) == (place.at, height):
                here.fail(f"it is at the same place as {other.name!r} (line {other.entry.line}); move or remove one")
        junctions[name] = JunctionPlan(
            id=k, name=name, centre=place.at, height=height, roundabout=roundabout, entry=here
        )
    if not junctions:
        entry.fail("there is no junction; add one")
    return junctions


def _junction(entry: Entry, defaults: StreetDefaults) -> tuple[Bend, RoundaboutPlan | None]:
    """Where a junction is, and its ring."""
    if not entry.is_mapping:
        return point(entry), None
    element = entry.element
    fields = entry.fields(JUNCTION_KEYS, required=("at",))
    place = point(fields["at"])
    if "roundabout" not in fields:
        for key in ("lanes", "speed"):
            if key in fields:
                fields[key].named(element).fail(f"{key!r} is for roundabouts; remove it, or add 'roundabout: 30'")
        return place, None
    lanes, limit = fields.get("lanes"), fields.get("speed")
    return place, RoundaboutPlan(
        radius=fields["roundabout"].number(*ROUNDABOUT_RADIUS, "metres"),
        lanes=lanes.whole(*ROUNDABOUT_LANES, "lanes") if lanes else 1,
        speed=speed(limit) if limit else min(ROUNDABOUT_SPEED, defaults.speed),
    )


def _sites(entry: Entry) -> tuple[tuple[Point, Entry], ...]:
    sites: dict[Point, Entry] = {}
    for element in entry.elements("a list of points [x, y] in metres"):
        bend = point(element, flat=True)
        place = bend.at
        if place in sites:
            element.fail(f"{told(bend)} is there twice (first in line {sites[place].line}); remove one")
        sites[place] = element
    if not sites:
        entry.fail("there is no site; add one, or remove the key to have them laid out")
    return tuple(sites.items())
