"""What stands at the junctions of a town file: `lights` and their phases, `stops`, `yields` and `crosswalks`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from dorothie_gym.world.town.yaml_town.nodes import Entry, listed
from dorothie_gym.world.town.yaml_town.plan import GreenPlan, JunctionPlan, LightsPlan, StreetPlan
from dorothie_gym.world.town.yaml_town.streets import approaches

LIGHTS_KEYS = ("at", "offset", "phases")
PHASE_KEYS = ("green", "left", "seconds")
SECONDS = (3.0, 300.0)
"""Length of a phase [s]."""
OFFSET = (0.0, 600.0)
"""Start of a programme [s]."""

Junctions: TypeAlias = Mapping[str, JunctionPlan]
Pairs: TypeAlias = tuple[tuple[str, StreetPlan], ...]


def read_lights(entry: Entry, junctions: Junctions, streets: Sequence[StreetPlan]) -> tuple[LightsPlan, ...]:
    """Reads the traffic lights, each a junction's name or a mapping.

    Raises:
        TownError: with the line and what to do.
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
    stops: Entry | None,
    yields: Entry | None,
    junctions: Junctions,
    streets: Sequence[StreetPlan],
    lights: Sequence[LightsPlan],
) -> tuple[Pairs, Pairs]:
    """Reads the stop signs and the yield signs.

    Raises:
        TownError: with the line and what to do.
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


def read_crosswalks(entry: Entry, junctions: Junctions, streets: Sequence[StreetPlan]) -> Pairs:
    """Reads the crosswalks.

    Raises:
        TownError: with the line and what to do.
    """
    pairs = _pairs(entry, junctions, streets)
    for element, _, street in pairs:
        if street.ramp:
            element.fail(f"{street.name!r} is a ramp, which nobody crosses on foot; remove it or name another street")
    return tuple((name, street) for _, name, street in pairs)


def _pairs(
    entry: Entry, junctions: Junctions, streets: Sequence[StreetPlan]
) -> tuple[tuple[Entry, str, StreetPlan], ...]:
    """Pairs [junction, street] and where they are written."""
    by_name = {street.name: street for street in streets}
    found: dict[tuple[str, str], Entry] = {}
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


def _lights(entry: Entry, junctions: Junctions, streets: Sequence[StreetPlan]) -> LightsPlan:
    fields = entry.fields(LIGHTS_KEYS, required=("at",)) if entry.is_mapping else {}
    at = fields.get("at", entry).named(entry.element)
    name = at.choice(junctions, "junction", "the name of a junction")
    if junctions[name].roundabout:
        at.fail(f"{name!r} is a roundabout, which has no lights but yield signs; remove it here")
    offset = fields["offset"].number(*OFFSET, "seconds") if "offset" in fields else 0.0
    phases = _phases(fields["phases"], name, streets) if "phases" in fields else ()
    return LightsPlan(junction=name, phases=phases, offset=offset, entry=entry)


def _phases(entry: Entry, junction: str, streets: Sequence[StreetPlan]) -> tuple[GreenPlan, ...]:
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


def _phase(entry: Entry, junction: str, here: Mapping[str, StreetPlan], streets: Sequence[StreetPlan]) -> GreenPlan:
    fields = entry.fields(PHASE_KEYS, required=("seconds",))
    green = _green(fields["green"], junction, here, streets) if "green" in fields else ()
    left = _green(fields["left"], junction, here, streets) if "left" in fields else ()
    if not green and not left:
        entry.fail("the phase names no street; add 'green: [...]' or 'left: [...]'")
    for name in left:
        if junction not in here[name].turn_lanes:
            fields["left"].fail(
                f"{name!r} has no turn lane at {junction!r}; add it to the 'turn_lanes' of the street,"
                " or name the street in 'green'"
            )
        if name in green:
            fields["left"].fail(
                f"{name!r} is in the 'green' of this phase already, turn lanes included; remove it here"
            )
    return GreenPlan(streets=green, left_only=left, seconds=fields["seconds"].number(*SECONDS, "seconds"))


def _green(
    entry: Entry, junction: str, here: Mapping[str, StreetPlan], streets: Sequence[StreetPlan]
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
