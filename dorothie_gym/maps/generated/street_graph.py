"""Graph of a generated town: junctions in whole metres, and the lines of streets between them.

Coordinates are whole numbers and headings come from `portable_math`, so that a seed gives the same town everywhere.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.portable_math import wrap_radians

GridPoint: TypeAlias = tuple[int, int]
"""Position [m], x east and y south."""


@dataclass(frozen=True)
class Edge:
    """Line of a street between two junctions, with the points that bend it."""

    start: int
    end: int
    bends: tuple[GridPoint, ...] = ()

    def far(self, node: int) -> int:
        """Returns the junction at the other end."""
        return self.end if node == self.start else self.start


@dataclass
class StreetGraph:
    """Planar multigraph of junctions and street lines.

    Attributes:
        places: positions of the junctions [m], by number.
        edges: lines, by number.
    """

    places: dict[int, GridPoint] = field(default_factory=dict)
    edges: dict[int, Edge] = field(default_factory=dict)
    _next_edge: int = 0

    def add(self, start: int, end: int, bends: Sequence[GridPoint] = ()) -> int:
        """Adds a line; returns its number."""
        self.edges[self._next_edge] = Edge(start, end, tuple(bends))
        self._next_edge += 1
        return self._next_edge - 1

    def at(self, node: int) -> list[int]:
        """Returns the lines at a junction; a loop counts twice."""
        return [k for k, edge in self.edges.items() for end in (edge.start, edge.end) if end == node]

    def degrees(self) -> dict[int, int]:
        """Returns the number of lines at each junction."""
        counts = dict.fromkeys(self.places, 0)
        for edge in self.edges.values():
            counts[edge.start] += 1
            counts[edge.end] += 1
        return counts

    def points(self, number: int, start: int | None = None) -> list[GridPoint]:
        """Returns the points of a line with both junctions [m], from its start or from another of its ends."""
        edge = self.edges[number]
        line = [self.places[edge.start], *edge.bends, self.places[edge.end]]
        return line if start in (None, edge.start) else line[::-1]

    def length(self, number: int) -> float:
        """Returns the length of a line along its points [m]."""
        return sum(pm.dist(a, b) for a, b in itertools.pairwise(self.points(number)))

    def heading(self, number: int, node: int) -> float:
        """Returns the direction in which a line leaves a junction [rad]."""
        (x, y), (u, v) = self.points(number, node)[:2]
        return pm.atan2(float(v - y), float(u - x))

    def gap(self, node: int, heading: float, without: Iterable[int] = ()) -> float:
        """Returns the smallest angle between a heading and the lines at a junction [rad]; pi if there is none."""
        left = [k for k in self.at(node) if k not in set(without)]
        return min((abs(wrap_radians(self.heading(k, node) - heading)) for k in left), default=math.pi)

    def smallest_gap(self, node: int) -> float:
        """Returns the smallest angle between two lines at a junction [rad]."""
        headings = sorted(self.heading(k, node) % (2.0 * math.pi) for k in self.at(node))
        around = [*headings, headings[0] + 2.0 * math.pi]
        return min(b - a for a, b in itertools.pairwise(around))

    def middle(self) -> tuple[float, float]:
        """Returns the mean position of all junctions [m]."""
        x, y = zip(*self.places.values(), strict=True)
        return sum(x) / len(x), sum(y) / len(y)

    def blocks(self) -> list[float]:
        """Returns the areas of the blocks between the lines [m^2], smallest first; the land around the town is none."""
        # for each line and the junction to which it leads, the line to the right of it and its far junction
        following: dict[tuple[int, int], tuple[int, int]] = {}
        for node in self.places:
            around = sorted(self.at(node), key=lambda k: self.heading(k, node))
            for k, left in zip(around, around[1:] + around[:1], strict=True):
                following[k, node] = left, self.edges[left].far(node)
        areas, rest = [], set(following)
        while rest:
            way, doubled = min(rest), 0
            while way in rest:
                rest.remove(way)
                line = self.points(way[0], self.edges[way[0]].far(way[1]))
                doubled += sum(x * v - u * y for (x, y), (u, v) in itertools.pairwise(line))
                way = following[way]
            areas.append(-doubled / 2.0)
        return sorted(area for area in areas if area > 0.0)

    # --- Changes ------------------------------------------------------------------------------------------------------

    def dissolve(self, node: int) -> None:
        """Makes a bend of a junction of two lines; a loop, which would end where it starts, is removed."""
        first, second = self.at(node)
        if first == second:
            del self.edges[first], self.places[node]
            return
        before, after = self.points(first, self.edges[first].far(node)), self.points(second, node)
        start, end = self.edges[first].far(node), self.edges[second].far(node)
        del self.edges[first], self.edges[second], self.places[node]
        if start != end:
            self.add(start, end, [*before[1:], *after[1:-1]])

    def join_at(self, node: int, first: int, second: int, bends: Sequence[GridPoint]) -> int:
        """Joins two lines at a junction into one with other bends; returns its number. The junction stays."""
        start, end = self.edges[first].far(node), self.edges[second].far(node)
        del self.edges[first], self.edges[second]
        return self.add(start, end, bends)

    def clean(self) -> None:
        """Removes dead ends and separate parts, and makes bends of junctions of two lines."""
        while True:
            degrees = self.degrees()
            ended = next((node for node in self.places if degrees[node] <= 1), None)
            if ended is not None:
                for k in self.at(ended):
                    del self.edges[k]
                del self.places[ended]
                continue
            passed = next((node for node in self.places if degrees[node] == 2), None)
            if passed is None:
                break
            self.dissolve(passed)
        self._keep_largest()

    def _keep_largest(self) -> None:
        parts = sorted(self._parts(), key=lambda part: (-len(part), min(part)))
        for node in [node for part in parts[1:] for node in part]:
            del self.places[node]
        self.edges = {k: edge for k, edge in self.edges.items() if edge.start in self.places}

    def _parts(self) -> Iterator[set[int]]:
        left = set(self.places)
        while left:
            part = self.reached(min(left))
            left -= part
            yield part

    def reached(self, start: int, without: int | None = None) -> set[int]:
        """Returns the junctions that are connected with one, optionally without a line."""
        neighbours: dict[int, list[int]] = {node: [] for node in self.places}
        for k, edge in self.edges.items():
            if k != without:
                neighbours[edge.start].append(edge.end)
                neighbours[edge.end].append(edge.start)
        found, queue = {start}, [start]
        while queue:
            for node in neighbours[queue.pop()]:
                if node not in found:
                    found.add(node)
                    queue.append(node)
        return found

    def is_bridge(self, number: int) -> bool:
        """Returns whether a part of the town would be cut off without a line."""
        edge = self.edges[number]
        return edge.end not in self.reached(edge.start, without=number)

    # --- Clearance ----------------------------------------------------------------------------------------------------

    def clearance(self, line: Sequence[GridPoint], without: Iterable[int] = (), around: float = 0.0) -> float:
        """Returns the smallest distance of a line from the other lines and junctions [m], 0 if it crosses one.

        Args:
            line: points [m].
            without: numbers of the lines that do not count.
            around: distance from both ends of the line within which neighbours do not count [m].
        """
        ends, skipped = (line[0], line[-1]), set(without)
        others = [self.points(k) for k in self.edges if k not in skipped]
        pieces = [piece for points in others for piece in itertools.pairwise(points)]
        own = list(itertools.pairwise(line))
        if any(crosses(*mine, *piece) for mine in own for piece in pieces):
            return 0.0
        pieces += [(place, place) for place in self.places.values() if place not in ends]
        samples = [point for a, b in own for point in along(a, b) if min(pm.dist(point, e) for e in ends) >= around]
        squares = [square_distance(point, *piece) for point in samples for piece in pieces]
        return math.sqrt(min(squares, default=math.inf))


# --- Geometry ---------------------------------------------------------------------------------------------------------

_SPACING = 12.0
"""Distance of the points at which clearance is measured [m]."""


def crosses(a: GridPoint, b: GridPoint, c: GridPoint, d: GridPoint) -> bool:
    """Returns whether two straight lines cross, not counting common ends; exact."""
    if {a, b} & {c, d}:
        return False
    return _side(a, b, c) * _side(a, b, d) <= 0 and _side(c, d, a) * _side(c, d, b) <= 0


def _side(a: GridPoint, b: GridPoint, p: GridPoint) -> int:
    cross = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    return (cross > 0) - (cross < 0)


def along(a: GridPoint, b: GridPoint) -> list[tuple[float, float]]:
    """Returns points on a straight line, both ends included [m]."""
    count = max(1, int(pm.dist(a, b) / _SPACING))
    return [(a[0] + (b[0] - a[0]) * k / count, a[1] + (b[1] - a[1]) * k / count) for k in range(count + 1)]


def square_distance(point: tuple[float, float], a: GridPoint, b: GridPoint) -> float:
    """Returns the square of the distance of a point from a straight line between two points [m^2]."""
    dx, dy, x, y = b[0] - a[0], b[1] - a[1], point[0] - a[0], point[1] - a[1]
    square = dx * dx + dy * dy
    t = min(1.0, max(0.0, (x * dx + y * dy) / square)) if square else 0.0
    x, y = x - t * dx, y - t * dy
    return x * x + y * y


def turns_along(line: Sequence[GridPoint]) -> list[float]:
    """Returns the changes of direction at the bends of a line, not negative [rad]."""
    headings = [pm.atan2(float(v - y), float(u - x)) for (x, y), (u, v) in itertools.pairwise(line)]
    return [abs(wrap_radians(b - a)) for a, b in itertools.pairwise(headings)]


def whole(x: float, y: float) -> GridPoint:
    """Returns the nearest position in whole metres."""
    return math.floor(x + 0.5), math.floor(y + 0.5)
