"""Places of signals and crosswalks of a town along its roads."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import NO_JUNCTION, Array, Crosswalk, Signal
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.opendrive.cross_sections import CrossSection
    from dorothie_gym.maps.opendrive.road_layout import RoadLayout
    from dorothie_gym.maps.opendrive.strands import Strand

# Distance between the places of a road that are compared with objects [m].
_STEP = 1.0

# Distance of a reference to a signal from the end of its lanes [m]: it lies inside of their lane section.
_INSIDE = 0.01

# Largest error along the road at which an object can be placed beside it [m].
_BESIDE = 1e-6


@dataclass(frozen=True, kw_only=True)
class SignalPlace:
    """Signal, or reference to a signal of another road.

    Attributes:
        signal: the signal.
        reference: whether it stands beside another road.
        s, t: distance along the road, and to the left of its reference line [m].
        heading: direction of the road there [rad].
        lanes: numbers of the lanes that it applies to.
        forward: whether it applies to traffic along the reference line.
    """

    signal: Signal
    reference: bool
    s: float
    t: float
    heading: float
    lanes: tuple[int, ...]
    forward: bool


@dataclass(frozen=True, kw_only=True)
class CrosswalkPlace:
    """Crosswalk with its place beside a road as in `SignalPlace`; corners (n, 2) are relative to it [m]."""

    crosswalk: Crosswalk
    s: float
    t: float
    heading: float
    corners: Array


class Roadside:
    """Signals and crosswalks, by the number of their road.

    Args:
        roads: roads.
        sections: lane sections of each road.

    Attributes:
        signals, crosswalks: those of each road.
    """

    def __init__(self, roads: Sequence[RoadLayout], sections: Sequence[tuple[CrossSection, ...]]) -> None:
        self.signals: defaultdict[int, list[SignalPlace]] = defaultdict(list)
        self.crosswalks: defaultdict[int, list[CrosswalkPlace]] = defaultdict(list)
        self._roads = {road.number: road for road in roads}
        self._sections = {road.number: of for road, of in zip(roads, sections, strict=True)}
        self._of = {s.lane: (road.number, s) for road in roads for s in road.strands if s.lane is not None}
        places = [road.axis.place(np.arange(0.0, road.axis.length, _STEP))[:, :2] for road in roads]
        self._owners = np.repeat([road.number for road in roads], [len(rows) for rows in places])
        self._tree = cKDTree(np.concatenate(places))

    # --- Signals -----------------------------------------------------------------------------------------------------

    def add_signal(self, signal: Signal) -> None:
        """Places a signal beside the road of its lanes, or beside a road near it with references to it."""
        ruled: defaultdict[tuple[int, float, bool], list[int]] = defaultdict(list)
        for lane in signal.lanes:
            road, strand = self._of[lane]
            along = strand.forward
            number = self._section(road, strand).number(strand)
            ruled[road, strand.end if along else strand.begin, along].append(number)
        x, y, _ = signal.position
        place = np.array([x, -y])
        stands = None
        if len(ruled) == 1:
            (road, s, forward), numbers = next(iter(ruled.items()))
            stands = self._beside(road, place)
            if stands is not None and self._holds(road, s, stands[0]):
                self._add(signal, (road, *stands), numbers, forward, reference=False)
                return
        near = self._nearest(place)
        self._add(signal, near, (), pm.cos(signal.heading + near[3]) < 0.0, reference=False)
        for (road, end, forward), numbers in ruled.items():
            s = min(max(end - _INSIDE, 0.0), end) if forward else end + _INSIDE
            x, y, heading = (float(v) for v in self._roads[road].axis.place(np.array([s]))[0])
            t = (float(place[1]) - y) * pm.cos(heading) - (float(place[0]) - x) * pm.sin(heading)
            self._add(signal, (road, s, t, heading), numbers, forward, reference=True)

    def _add(
        self,
        signal: Signal,
        place: tuple[int, float, float, float],
        lanes: Sequence[int],
        forward: bool,
        *,
        reference: bool,
    ) -> None:
        road, s, t, heading = place
        numbers = tuple(sorted(lanes))
        self.signals[road].append(
            SignalPlace(signal=signal, reference=reference, s=s, t=t, heading=heading, lanes=numbers, forward=forward)
        )

    def _section(self, road: int, strand: Strand) -> CrossSection:
        """Returns the section with the end of a lane."""
        return next(
            s for s in self._sections[road] if (s.end == strand.end if strand.forward else s.start == strand.begin)
        )

    def _holds(self, road: int, end: float, s: float) -> bool:
        """Returns whether a distance lies in the lane section with the end of a lane, and not at its edge."""
        return any(
            section.start < s < section.end or (s == end and end in (0.0, self._roads[road].axis.length))
            for section in self._sections[road]
            if end in (section.start, section.end) and section.start <= s <= section.end
        )

    # --- Crosswalks --------------------------------------------------------------------------------------------------

    def add_crosswalk(self, crosswalk: Crosswalk) -> None:
        """Places a crosswalk beside the road nearest to its middle."""
        outline = crosswalk.outline * (1.0, -1.0)
        middle = outline.mean(axis=0)
        road, s, t, heading = self._nearest(middle)
        x, y, _ = (float(v) for v in self._roads[road].axis.place(np.array([s]))[0])
        c, n = pm.cos(heading), pm.sin(heading)
        dx, dy = outline[:, 0] - (x - t * n), outline[:, 1] - (y + t * c)
        corners = np.column_stack((dx * c + dy * n, dy * c - dx * n))
        self.crosswalks[road].append(CrosswalkPlace(crosswalk=crosswalk, s=s, t=t, heading=heading, corners=corners))

    # --- Places ------------------------------------------------------------------------------------------------------

    def _nearest(self, place: Array) -> tuple[int, float, float, float]:
        """Returns the nearest road beside a place (2,), outside junctions if possible, and the place along it."""
        rows = np.atleast_1d(self._tree.query(place, k=min(400, self._tree.n))[1])
        near = dict.fromkeys(int(self._owners[k]) for k in rows)
        for crosses in (False, True):
            for road in near:
                if (self._roads[road].junction != NO_JUNCTION) == crosses:
                    found = self._beside(road, place)
                    if found is not None:
                        return (road, *found)
        road = next(iter(near))
        station, aside, _ = self._roads[road].axis.project(place[None])
        heading = float(self._roads[road].axis.place(station)[0, 2])
        return road, float(station[0]), float(aside[0]), heading

    def _beside(self, road: int, place: Array) -> tuple[float, float, float] | None:
        """Returns distance along a road, distance to the left of it, and its direction; None beyond its ends."""
        axis = self._roads[road].axis
        station, aside, ahead = axis.project(place[None])
        if abs(float(ahead[0])) > _BESIDE:
            return None
        return float(station[0]), float(aside[0]), float(axis.place(station)[0, 2])
