"""SDN's `trajectory.csv`: poses of the car at 10 Hz, and their lanes on the map of the town."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.sdn.files import number_of, read_csv
from dorothie_gym.errors import SessionError
from dorothie_gym.maps.model import NO_STREET, LinkType
from dorothie_gym.session.recording.files import MAX_FRAME, MAX_FRAMES
from dorothie_gym.session.recording.frames import read_frames, write_frames
from dorothie_gym.session.recording.header import NO_LANE
from dorothie_gym.session.recording.surroundings import Surroundings
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH, TENTHS, TRAJECTORY_DTYPE, Trajectory
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session
    from dorothie_gym.session.recording.validation import ReadReport

MAX_LANE_DISTANCE: Final = 10.0
"""Largest distance of a position from the lane that it is assigned to [m]."""

EQUALLY_CLOSE: Final = 2.0
"""Difference of distances up to which the numbers of a position choose its lane, about half a lane's width [m]."""


@dataclass(frozen=True)
class LanePosition:
    """Position in the town: lane (-1: none), distance along it [m], street (-1: none)."""

    lane: int = NO_LANE
    station: float = 0.0
    street: int = NO_STREET


class SdnMap:
    """Lookup of positions in a town that may be unknown.

    Args:
        town: the town, or None: lookups then find nothing.
    """

    def __init__(self, town: Town | None) -> None:
        self.town = town
        self._by_ids: dict[tuple[int, int], list[int]] = defaultdict(list)
        for lane in town.lanes if town is not None else ():
            self._by_ids[lane.road_id, lane.lane_id].append(lane.id)

    def locate(self, x: float, y: float, road: int | None = None, lane: int | None = None) -> LanePosition:
        """Returns the position closest to (x, y) [m].

        The numbers only choose between lanes that are about equally close, as they are placeholders in some files.
        """
        if self.town is None:
            return LanePosition()
        position = np.array([x, y])
        found = [(*self.town.lanes[k].project(position), k) for k in self._near(x, y)]
        if not found:
            return LanePosition()
        closest = min(abs(lateral) for _, lateral, _ in found)
        same = [row for row in found if abs(row[1]) <= closest + EQUALLY_CLOSE and row[2] in self._numbered(road, lane)]
        station, lateral, number = min(same or found, key=lambda item: (abs(item[1]), item[2]))
        if abs(lateral) > MAX_LANE_DISTANCE:
            return LanePosition()
        return LanePosition(number, station, self.town.lanes[number].street)

    def _numbered(self, road: int | None, lane: int | None) -> Sequence[int]:
        return () if road is None or lane is None else self._by_ids.get((road, lane), ())

    def _near(self, x: float, y: float) -> list[int]:
        """Returns the lanes whose bounding boxes are within reach of (x, y)."""
        inside = np.all((self._boxes[:, :2] <= (x, y)) & (self._boxes[:, 2:] >= (x, y)), axis=1)
        return [int(k) for k in np.flatnonzero(inside)]

    @cached_property
    def _boxes(self) -> NDArray[np.float64]:
        """Smallest x and y, and largest x and y, of the surroundings of each lane, (n, 4) [m]."""
        points = [lane.points[:, :2] for lane in self.town.lanes] if self.town is not None else []
        boxes = [(*each.min(axis=0), *each.max(axis=0)) for each in points]
        reach = MAX_LANE_DISTANCE * np.array([-1.0, -1.0, 1.0, 1.0])
        return np.array(boxes, dtype=np.float64).reshape(len(boxes), 4) + reach

    def lane_of(self, x: float, y: float, road: int, lane: int) -> int:
        """Returns the lane with the given numbers at (x, y), or -1; fast enough for every frame."""
        known = self._by_ids.get((road, lane), ())
        if len(known) == 1 and self.town is not None:
            box = self._boxes[known[0]]
            if box[0] <= x <= box[2] and box[1] <= y <= box[3]:
                lateral = self.town.lanes[known[0]].project(np.array([x, y]))[1]
                if abs(lateral) <= MAX_LANE_DISTANCE:
                    return known[0]
        return self.locate(x, y, road, lane).lane if known else NO_LANE

    def turn_angle(self, lane: int, road: int, junction: int | None = None) -> float | None:
        """Returns the angle [degrees, positive left] of the turn into a road.

        The angle belongs to the exit into the road from the car's lane, or otherwise from an adjacent lane. If there is
        none, or the lane is unknown, it belongs to the only approach with a connector into the road.

        Args:
            lane: lane of the car; -1 for an unknown one.
            road: number of the target road, or of the connecting road to it.
            junction: junction that the car crosses next; None or -1 for an unknown one.
        """
        town = self.town
        if town is None:
            return None
        if lane >= 0:
            found = self._angle_ahead(town, lane, road)
            if found is not None:
                return found
        approaches = self._approaches(town, road)
        at_next = {key: angle for key, angle in approaches.items() if key[0] == junction}
        for choice in (at_next, approaches):
            own = {key: angle for key, angle in choice.items() if lane >= 0 and key[1] == town.lanes[lane].road_id}
            for only in (own, choice):
                if len(only) == 1:
                    return next(iter(only.values()))
        return None

    def _angle_ahead(self, town: Town, lane: int, road: int) -> float | None:
        """Returns the angle into a road at the next junction ahead, from a lane or from adjacent lanes."""
        lanes = self._side_by_side(town, lane)
        for _ in range(len(town.lanes)):  # along the road to the junction
            for beside in lanes:
                for way in town.exits(beside):
                    if road in (town.lanes[way.lane].road_id, town.lanes[way.connector].road_id):
                        return float(way.angle)
            onward = [exits[0].lane for each in lanes if len(exits := town.exits(each)) == 1]
            if any(way.junction_id >= 0 for each in lanes for way in town.exits(each)) or not onward:
                return None
            lanes = list(dict.fromkeys(onward))
        return None

    @staticmethod
    def _side_by_side(town: Town, lane: int) -> list[int]:
        """Returns a lane and those that lane changes lead to, nearest first."""
        found = [lane]
        for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT):
            beside = town.neighbour(lane, side)
            while beside is not None and beside not in found:
                found.append(beside)
                beside = town.neighbour(beside, side)
        return found

    @staticmethod
    def _approaches(town: Town, road: int) -> dict[tuple[int, int], float]:
        """Returns the angle into a road for each junction and road from which connectors lead there."""
        found: dict[tuple[int, int], float] = {}
        for lane in town.lanes:
            for way in town.exits(lane.id):
                connector = town.lanes[way.connector]
                if way.junction_id >= 0 and road in (town.lanes[way.lane].road_id, connector.road_id):
                    found.setdefault((way.junction_id, lane.road_id), float(way.angle))
        return found


# --- SDN's `trajectory.csv`: pose of the car at 10 Hz ----------------------------------------------------------------

CSV_COLUMNS: Final = ("frame", "x", "y", "yaw", "junction_id", "road_id", "lane_id")
"""Columns of the layout; those after `yaw` are optional."""

_NEEDED: Final = CSV_COLUMNS[:4]
_IDS: Final = CSV_COLUMNS[4:]

MAX_COORDINATE: Final = 1e9
"""Largest magnitude of a valid coordinate or yaw [m, degrees]."""

MIN_MOTION: Final = 0.2
"""Minimum distance between two frames for deriving the heading from the motion [m]."""


@dataclass(frozen=True)
class CarPoses:
    """Poses of the car.

    Attributes:
        frames: (n,) int64, 10 Hz, ascending.
        x: (n,) [m].
        y: (n,) [m].
        heading: (n,) [rad, clockwise].
        ids: junction, road and lane in OpenDRIVE's numbers, each (n,) int64; -1 in `junction_id` is none.
        further: other columns of the file, each (n,) float64.
    """

    frames: NDArray[np.int64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    heading: NDArray[np.float64]
    ids: dict[str, NDArray[np.int64]]
    further: dict[str, NDArray[np.float64]]


def read_places(path: Path, report: ReadReport) -> CarPoses:
    """Returns the poses of the file.

    The file ends at a second header line. Rows with a missing number are left out, rows out of order are sorted, and
    if a frame has several rows, the first is used.

    Raises:
        SessionError: it lacks a header line or one of the first four columns, is too large, or is not UTF-8.
    """
    if not path.is_file():
        report.miss(path.name)
        return _places(np.empty((0, len(CSV_COLUMNS))), list(CSV_COLUMNS))
    lines = read_csv(path, MAX_FRAMES)
    start = next((k for k, line in enumerate(lines) if line), len(lines))
    names = [name.casefold() for name in lines[start]] if start < len(lines) else []
    for name in _NEEDED:
        if name not in names:
            shown = ", ".join(names)[:100]
            raise SessionError(f"{path}, line {start + 1}: the columns are {shown!r}; {name!r} is missing")
    for k, name in enumerate(names):
        if name in names[:k]:
            raise SessionError(f"{path}, line {start + 1}: the column {name[:40]!r} is there twice; keep one of them")
        if name not in CSV_COLUMNS:
            report.keep(f"{path.name}: column {name[:40]!r}")
    for name in _IDS:
        if name not in names:
            report.miss(f"{path.name}: column {name!r}")
    return _places(_numbers(path, lines, start + 1, names, report), names)


def _numbers(
    path: Path, lines: list[list[str]], start: int, names: list[str], report: ReadReport
) -> NDArray[np.float64]:
    rows: list[list[float]] = []
    needed = [names.index(name) for name in _NEEDED]
    bad = 0
    for number, line in enumerate(lines[start:], start=start + 1):
        if line and line[0].casefold() == names[0]:
            left = sum(bool(rest) for rest in lines[number:])
            report.repair(f"{path.name}: ends at a second header (line {number}); {left} lines after it were left out")
            break
        if not line:
            continue
        values = [number_of(text) for text in line]
        row = [math.nan if value is None else value for value in values[: len(names)]]
        row += [math.nan] * (len(names) - len(row))
        frame = row[needed[0]]
        if (
            any(not abs(row[k]) <= MAX_COORDINATE for k in needed[1:])
            or not 0 <= frame < MAX_FRAME
            or frame != int(frame)
        ):
            bad += 1
        else:
            rows.append(row)
    report.repair(f"{path.name}: rows without frame or place were left out", bad)
    table = np.array(rows, dtype=np.float64).reshape(len(rows), len(names))
    frames = table[:, needed[0]]
    if np.any(np.diff(frames) < 0):
        report.repair(f"{path.name}: rows were out of order by frame, and were put in order")
        table = table[np.argsort(frames, kind="stable")]
    again = np.flatnonzero(np.diff(table[:, needed[0]], prepend=-1.0) == 0)
    report.repair(f"{path.name}: of several rows of a frame the first was taken", len(again))
    return np.delete(table, again, axis=0)


def _places(table: NDArray[np.float64], names: list[str]) -> CarPoses:
    columns = {name: table[:, k] for k, name in enumerate(names)}
    x, y, yaw = columns["x"], columns["y"], columns["yaw"]
    missing = np.full(len(table), -1.0)
    ids = {
        name: np.nan_to_num(columns.get(name, missing), nan=-1.0, posinf=-1.0, neginf=-1.0).clip(-(2**40), 2**40)
        for name in _IDS
    }
    return CarPoses(
        frames=columns["frame"].astype(np.int64),
        x=x,
        y=y,
        heading=yaw if _is_radians(x, y, yaw) else np.radians(yaw),
        ids={name: values.astype(np.int64) for name, values in ids.items()},
        further={name: values for name, values in columns.items() if name not in CSV_COLUMNS},
    )


def _is_radians(x: NDArray[np.float64], y: NDArray[np.float64], yaw: NDArray[np.float64]) -> bool:
    """Returns whether yaw is in radians, not degrees: the unit that agrees with the motion of the car."""
    dx, dy = np.diff(x), np.diff(y)
    moved = pn.hypot(dx, dy) > MIN_MOTION
    if not np.any(moved) or np.any(np.abs(yaw) > 2 * np.pi):
        return False
    course, looked = pn.arctan2(dy, dx)[moved], yaw[:-1][moved]
    return bool(np.mean(pn.cos(looked - course)) > np.mean(pn.cos(np.radians(looked) - course)))


def trajectory_of_places(places: CarPoses, first_frame: int, place: SdnMap) -> tuple[Trajectory, Surroundings]:
    """Returns a trajectory in frames of 30 Hz: speed from the motion, unknown controls, ids as further columns.

    Args:
        places: poses of the car.
        first_frame: frame (10 Hz) at which the session begins.
        place: map of the town.
    """
    count = len(places.frames)
    trajectory = np.zeros(count, dtype=TRAJECTORY_DTYPE)
    trajectory["frame"] = FRAMES_PER_TENTH * (places.frames - first_frame)
    trajectory["x"], trajectory["y"], trajectory["heading"] = places.x, places.y, places.heading
    for name in ("throttle", "steer", "brake"):
        trajectory[name] = np.nan
    if count > 1:
        # Over the time before, never after: a state must not reveal the car's next motion.
        way = pn.hypot(np.diff(places.x), np.diff(places.y))
        trajectory["speed"][1:] = way / (np.diff(places.frames) / TENTHS)
    roads, lanes = places.ids["road_id"].tolist(), places.ids["lane_id"].tolist()
    if place.town is None:
        trajectory["lane"] = NO_LANE
    else:
        each = zip(places.x.tolist(), places.y.tolist(), roads, lanes, strict=True)
        trajectory["lane"] = [place.lane_of(*row) for row in each]
    return trajectory, Surroundings(columns={**places.ids, **places.further})


# --- Surroundings, an addition of this package to the release layout -------------------------------------------------


def write_scene(path: Path, session: Session) -> None:
    """Writes the surroundings of the car at frames of 10 Hz, if there are any.

    Raises:
        OSError: it cannot be written.
    """
    trajectory = session.trajectory[session.trajectory["frame"] % FRAMES_PER_TENTH == 0]
    scene = session.scene.at_frames(trajectory["frame"])
    if any(map(len, (scene.actors, scene.lights, scene.weather))):
        write_frames(path, trajectory, scene)


def read_scene(path: Path, scene: Surroundings, trajectory: Trajectory, report: ReadReport) -> Surroundings:
    """Returns a scene with the surroundings from the file, at the frames of a trajectory.

    Args:
        path: the file, which is optional.
        scene: scene of the layout's own files.
        trajectory: trajectory of the session.
        report: receives unknown fields.

    Raises:
        SessionError: the file is damaged; the message names it.
    """
    if not path.is_file():
        return scene
    _, around = read_frames(path, report)
    around = around.at_frames(trajectory["frame"])
    return replace(scene, actors=around.actors, lights=around.lights, weather=around.weather)
