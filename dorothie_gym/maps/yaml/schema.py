"""Schema of the YAML town language: reads a file into a validated plan.

docs/towns.md describes the language. The checks here need no geometry: keys, types, ranges, names, and references
between elements. The layout checks the geometry.

A village::

    name: village                  # optional, else the file's name
    speed: 40                      # km/h, optional
    traffic: left                  # side of the road, optional, else right
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

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.yaml.entries import YamlEntry, listed, parse_nodes, read_nodes
from dorothie_gym.maps.yaml.plan import Bend, GreenPlan, JunctionPlan, LightsPlan, RoundaboutPlan, StreetPlan, TownPlan
from dorothie_gym.maps.yaml.street_schema import (
    StreetDefaults,
    approaches,
    lane_width,
    pavement,
    point,
    read_street,
    shown,
    speed,
)

if TYPE_CHECKING:
    from dorothie_gym.maps.yaml.geometry import Point

LIGHTS_KEYS = ("at", "offset", "phases")
PHASE_KEYS = ("green", "left", "right", "seconds")
TRAFFIC = tuple(str(side) for side in DrivingSide)
SECONDS = (3.0, 300.0)
"""Range of phase durations [s]."""
OFFSET = (0.0, 600.0)
"""Range of programme offsets [s]."""

Junctions: TypeAlias = Mapping[str, JunctionPlan]
Pairs: TypeAlias = tuple[tuple[str, StreetPlan], ...]


def read_lights(entry: YamlEntry, junctions: Junctions, streets: Sequence[StreetPlan]) -> tuple[LightsPlan, ...]:
    """Reads the traffic lights, each given by a junction name or a mapping.

    Raises:
        TownError: with the line and the remedy.
    """
    lights: dict[str, LightsPlan] = {}
    for element in entry.names("a list of junctions"):
        plan = _lights(element, junctions, streets)
        if plan.junction in lights:
            first = lights[plan.junction].entry.line
            element.fail(f"{plan.junction!r} is there twice (first in line {first}); remove one")
        lights[plan.junction] = plan
    return tuple(lights.values())


def read_signs(
    stops: YamlEntry | None,
    yields: YamlEntry | None,
    junctions: Junctions,
    streets: Sequence[StreetPlan],
    lights: Sequence[LightsPlan],
) -> tuple[Pairs, Pairs]:
    """Reads the stop signs and the yield signs.

    Raises:
        TownError: with the line and the remedy.
    """
    lit = {plan.junction: plan.entry.line for plan in lights}
    found: tuple[Pairs, ...] = ()
    for entry in (stops, yields):
        pairs = _pairs(entry, junctions, streets) if entry else ()
        for element, name, street in pairs:
            if junctions[name].roundabout:
                element.fail(f"the entries of roundabout {name!r} have yield signs by themselves; remove this one")
            if name in lit:
                element.fail(f"{name!r} has lights (line {lit[name]}); remove this sign or the lights")
            if not approaches(street, name):
                element.fail(f"{street.name!r} only leaves {name!r} (it is one-way); remove the sign or name another")
            if found and (name, street) in found[0]:
                element.fail(f"{street.name!r} has a stop sign at {name!r} already; remove one of the two")
        found += (tuple((name, street) for _, name, street in pairs),)
    return found[0], found[1]


def read_crosswalks(entry: YamlEntry, junctions: Junctions, streets: Sequence[StreetPlan]) -> Pairs:
    """Reads the crosswalks.

    Raises:
        TownError: with the line and the remedy.
    """
    pairs = _pairs(entry, junctions, streets)
    for element, _, street in pairs:
        if street.ramp:
            element.fail(f"{street.name!r} is a ramp, which has no crosswalks; remove it or name another street")
    return tuple((name, street) for _, name, street in pairs)


def _pairs(
    entry: YamlEntry, junctions: Junctions, streets: Sequence[StreetPlan]
) -> tuple[tuple[YamlEntry, str, StreetPlan], ...]:
    """Reads pairs [junction, street], with their positions in the file."""
    by_name = {street.name: street for street in streets}
    found: dict[tuple[str, str], YamlEntry] = {}
    for element in entry.elements("a list of [junction, street]"):
        first, second = element.pair("[junction, street], each pair in its own brackets")
        name = first.choice(junctions, "junction", "the name of a junction")
        street = second.choice(by_name, "street", "the name of a street")
        if name not in by_name[street].course:
            here = [other.name for other in streets if name in other.course]
            second.fail(f"{street!r} does not run through {name!r}; name a street that does: {listed(here)}")
        if (name, street) in found:
            element.fail(f"it is there twice (first in line {found[name, street].line}); remove one")
        found[name, street] = element
    return tuple((element, name, by_name[street]) for (name, street), element in found.items())


def _lights(entry: YamlEntry, junctions: Junctions, streets: Sequence[StreetPlan]) -> LightsPlan:
    fields = entry.fields(LIGHTS_KEYS, required=("at",)) if entry.is_mapping else {}
    at = fields.get("at", entry).named(entry.element)
    name = at.choice(junctions, "junction", "the name of a junction")
    if junctions[name].roundabout:
        at.fail(f"{name!r} is a roundabout, which has no lights but yield signs; remove it here")
    offset = fields["offset"].number(*OFFSET, "seconds") if "offset" in fields else 0.0
    phases = _phases(fields["phases"], name, streets) if "phases" in fields else ()
    return LightsPlan(junction=name, phases=phases, offset=offset, entry=entry)


def _phases(entry: YamlEntry, junction: str, streets: Sequence[StreetPlan]) -> tuple[GreenPlan, ...]:
    entry = entry.named(f"lights at {junction!r}")
    here = {street.name: street for street in streets if junction in street.course}
    phases = tuple(
        _phase(element, junction, here, streets) for element in entry.elements("a list of phases {green, seconds}")
    )
    if not phases:
        entry.fail("there is no phase; add one, or remove the key to have them laid out")
    waiting = [
        name
        for name, street in here.items()
        if approaches(street, junction) and not any(name in phase.streets for phase in phases)
    ]
    if waiting:
        entry.fail(f"{waiting[0]!r} never gets green; name it in the 'green' of a phase")
    return phases


def _phase(entry: YamlEntry, junction: str, here: Mapping[str, StreetPlan], streets: Sequence[StreetPlan]) -> GreenPlan:
    traffic = streets[0].traffic
    turns = str(traffic.far_turn)  # those of the lanes in the median
    fields = entry.fields([key for key in PHASE_KEYS if key != traffic.near_turn], required=("seconds",))
    green = _green(fields["green"], junction, here, streets) if "green" in fields else ()
    turning = _green(fields[turns], junction, here, streets) if turns in fields else ()
    if not green and not turning:
        entry.fail(f"the phase names no street; add 'green: [...]' or '{turns}: [...]'")
    for name in turning:
        if junction not in here[name].turn_lanes:
            fields[turns].fail(
                f"{name!r} has no turn lane at {junction!r}; add it to the 'turn_lanes' of the street,"
                " or name the street in 'green'"
            )
        if name in green:
            fields[turns].fail(f"{name!r} is in the 'green' of this phase already, turn lanes included; remove it here")
    return GreenPlan(streets=green, turn_lanes_only=turning, seconds=fields["seconds"].number(*SECONDS, "seconds"))


def _green(
    entry: YamlEntry, junction: str, here: Mapping[str, StreetPlan], streets: Sequence[StreetPlan]
) -> tuple[str, ...]:
    found: list[str] = []
    for element in entry.names("a list of streets"):
        name = element.choice([street.name for street in streets], "street", "the name of a street")
        if name not in here:
            element.fail(f"{name!r} does not run through {junction!r}; name a street that does: {listed(list(here))}")
        if not approaches(here[name], junction):
            element.fail(f"{name!r} only leaves {junction!r} (it is one-way) and needs no green; remove it")
        if name in found:
            element.fail(f"{name!r} is there twice; remove one")
        found.append(name)
    return tuple(found)


# --- Whole town ------------------------------------------------------------------------------------------------------

TOWN_KEYS = (
    "name", "speed", "cruise", "width", "sidewalk", "traffic", "junctions", "streets", "lights", "stops", "yields",
    "crosswalks",
    "sites",
)  # fmt: skip
JUNCTION_KEYS = ("at", "roundabout", "lanes", "speed")
ROUNDABOUT_SPEED = 30.0
"""Default speed limit of roundabouts [km/h], unless that of the town is lower."""
ROUNDABOUT_RADIUS = (8.0, 150.0)
"""Range of radii of the centre line of a ring [m]."""
ROUNDABOUT_LANES = (1, 3)


CRUISE_RANGE = (10.0, 60.0)
"""Range of the cruise speed of a town with slow traffic [km/h]."""


def read_plan(path: Path) -> TownPlan:
    """Reads a town file.

    Raises:
        TownError: with the file, the line, the element, and the remedy.
    """
    return _plan(read_nodes(path), path.stem)


def parse_plan(text: str, source: str) -> TownPlan:
    """Reads a town from a text; `source` is its name in messages, and the name of a town that states none.

    Raises:
        TownError: with the line, the element, and the remedy.
    """
    return _plan(parse_nodes(text, source), source)


def _plan(top: YamlEntry, name: str) -> TownPlan:
    fields = {key: value.named(key) for key, value in top.fields(TOWN_KEYS, required=("junctions", "streets")).items()}
    traffic = DrivingSide(fields["traffic"].choice(TRAFFIC, "side", "right or left")) if "traffic" in fields else None
    defaults = StreetDefaults(traffic=traffic or DrivingSide.RIGHT)
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
        name=fields["name"].text("a name") if "name" in fields else name,
        junctions=junctions,
        streets=streets,
        lights=lights,
        stops=stops,
        yields=yields,
        crosswalks=read_crosswalks(fields["crosswalks"], junctions, streets) if "crosswalks" in fields else (),
        sites=_sites(fields["sites"]) if "sites" in fields else (),
        cruise=_cruise(fields["cruise"]) if "cruise" in fields else None,
        traffic=defaults.traffic,
    )


def _cruise(entry: YamlEntry) -> float:
    speed = entry.number(*CRUISE_RANGE, "km/h")
    if speed % 5.0:
        entry.fail(f"the cruise speed must be a multiple of 5 km/h, not {speed:g}")
    return speed


def _junctions(entry: YamlEntry, defaults: StreetDefaults) -> dict[str, JunctionPlan]:
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


def _junction(entry: YamlEntry, defaults: StreetDefaults) -> tuple[Bend, RoundaboutPlan | None]:
    """Reads the position of a junction, and its roundabout if it has one."""
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


def _sites(entry: YamlEntry) -> tuple[tuple[Point, YamlEntry], ...]:
    sites: dict[Point, YamlEntry] = {}
    for element in entry.elements("a list of points [x, y] in metres"):
        bend = point(element, flat=True)
        place = bend.at
        if place in sites:
            element.fail(f"{shown(bend)} is there twice (first in line {sites[place].line}); remove one")
        sites[place] = element
    if not sites:
        entry.fail("there is no site; add one, or remove the key to have them laid out")
    return tuple(sites.items())
