"""Draft of a generated town, streets with their properties and what is at junctions, and its text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.generated.named_streets import Chain
from dorothie_gym.maps.generated.street_graph import GridPoint, StreetGraph
from dorothie_gym.maps.town import SLOW_CRUISE


@dataclass
class StreetDraft:
    """Street of a generated town.

    Attributes:
        name: name in the file.
        chain: its junctions and lines.
        lanes: lanes in each direction.
        median: width of the median [m].
        one_way: whether it is driven along its chain only.
        turn_lanes: junctions with a left-turn lane.
        speed: speed limit [km/h], or None for that of the town.
        radius: radius of its bends [m], or None for the largest that fits.
    """

    name: str
    chain: Chain
    lanes: int = 1
    median: int = 0
    one_way: bool = False
    turn_lanes: tuple[int, ...] = ()
    speed: int | None = None
    radius: int | None = None

    @property
    def rank(self) -> tuple[int, int, int]:
        """Importance: the street of higher rank has priority."""
        return self.median, self.lanes, len(self.chain.edges)


@dataclass
class TownDraft:
    """Draft of a generated town.

    Attributes:
        name: name of the town.
        graph: junctions and lines.
        speed: speed limit [km/h].
        streets: streets, longest first.
        roundabouts: radius of the ring [m], lanes and name, by junction.
        heights: height of bends [m].
        lights: offset of the programme of lights [s], by junction.
        stops, yields, crosswalks: pairs of a junction and the index of a street.
        traffic: side of the road on which vehicles drive. The draft is that of right-hand traffic; its text is the
            mirror image if it is the left.
    """

    name: str
    graph: StreetGraph
    speed: int
    streets: list[StreetDraft]
    roundabouts: dict[int, tuple[int, int, str]] = field(default_factory=dict)
    heights: dict[GridPoint, float] = field(default_factory=dict)
    lights: dict[int, int] = field(default_factory=dict)
    stops: list[tuple[int, int]] = field(default_factory=list)
    yields: list[tuple[int, int]] = field(default_factory=list)
    crosswalks: list[tuple[int, int]] = field(default_factory=list)
    traffic: DrivingSide = DrivingSide.RIGHT

    def streets_at(self, node: int) -> list[int]:
        """Returns the indices of the streets through a junction."""
        return [k for k, street in enumerate(self.streets) if node in street.chain.nodes]

    def street_of(self, edge: int) -> int:
        """Returns the index of the street of a line."""
        return next(k for k, street in enumerate(self.streets) if edge in street.chain.edges)

    def junction_names(self) -> dict[int, str]:
        """Returns the name of each junction: of a roundabout its own, else a number."""
        return {
            node: self.roundabouts[node][2] if node in self.roundabouts else f"j{rank + 1}"
            for rank, node in enumerate(sorted(self.graph.places))
        }


def town_text(town: TownDraft) -> str:
    """Returns a town in the town language."""
    return "\n".join(_lines(town)) + "\n"


def _lines(town: TownDraft) -> Iterator[str]:
    names, graph = town.junction_names(), town.graph
    yield f"name: {_quoted(town.name)}"
    yield f"speed: {town.speed}"
    yield f"cruise: {SLOW_CRUISE:.0f}"
    if town.traffic is DrivingSide.LEFT:
        yield f"traffic: {town.traffic}"
    sign = town.traffic.sign
    yield "junctions:"
    for node, (x, y) in sorted(graph.places.items()):
        if node in town.roundabouts:
            radius, lanes, name = town.roundabouts[node]
            yield f"  {name}: {{at: [{x}, {sign * y}], roundabout: {radius}, lanes: {lanes}}}"
        else:
            yield f"  {names[node]}: [{x}, {sign * y}]"
    yield "streets:"
    for street in town.streets:
        yield f"  {street.name}: {{through: [{', '.join(_course(town, street, names))}]{_properties(street, names)}}}"
    if town.lights:
        yield "lights:"
        for node, offset in sorted(town.lights.items()):
            yield f"  - {{at: {names[node]}, offset: {offset}}}"
    for key, pairs in (("stops", town.stops), ("yields", town.yields), ("crosswalks", town.crosswalks)):
        if pairs:
            yield f"{key}:"
            for node, k in sorted(pairs):
                yield f"  - [{names[node]}, {town.streets[k].name}]"


def _quoted(text: str) -> str:
    return f'"{text}"'


def _course(town: TownDraft, street: StreetDraft, names: dict[int, str]) -> Iterator[str]:
    chain, sign = street.chain, town.traffic.sign
    yield names[chain.nodes[0]]
    for start, end, edge in zip(chain.nodes, chain.nodes[1:], chain.edges, strict=False):
        for x, y in town.graph.points(edge, start)[1:-1]:
            height = town.heights.get((x, y))
            yield f"[{x}, {sign * y}]" if height is None else f"[{x}, {sign * y}, {height:g}]"
        yield names[end]


def _properties(street: StreetDraft, names: dict[int, str]) -> str:
    parts = []
    if street.lanes != 1:
        parts.append(f"lanes: {street.lanes}")
    if street.one_way:
        parts.append("one_way: true")
    if street.median:
        parts.append(f"median: {street.median}")
    if street.turn_lanes:
        parts.append(f"turn_lanes: [{', '.join(names[node] for node in street.turn_lanes)}]")
    if street.speed is not None:
        parts.append(f"speed: {street.speed}")
    if street.radius is not None:
        parts.append(f"radius: {street.radius}")
    return "".join(f", {part}" for part in parts)
