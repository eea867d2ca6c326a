"""The rules of the road looked at in plain Python, place by place and lane by lane, to compare the compiled watch with;
and ways of cars that break them at random."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.maps.model import LEVEL_HEIGHT, Array, Signal, SignalKind
from dorothie_gym.maps.right_of_way import right_of_way
from dorothie_gym.maps.town import LightColour
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.network.lane import PolylineLane
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.town_arrays import OFF_ROAD_MARGIN
from dorothie_gym.sim.traffic.parameters import AT_LINE, TRAFFIC_STANDING
from dorothie_gym.sim.traffic_rules import AGAINST, BREACH_PAUSE, FORGET, NEARBY, WorldEvent, WorldEventKind

LENGTH = 5.0
NOT_YET = -(10**9)


class PlainWatch:
    """`sim.traffic_rules.watch` with loops over everything."""

    def __init__(self, network: TownNetwork) -> None:
        town, rules = network.town, right_of_way(network.town)
        self.network, self.town = network, town
        self.signals: dict[int, Signal] = {}
        for signal in town.signals:
            if signal.kind in (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP):
                self.signals.update({lane: signal for lane in signal.lanes if rules.control(lane) is signal.kind})
        self.lines = sorted(self.signals)
        self.ends = np.array([town.lanes[lane].points[-1] for lane in self.lines]).reshape(-1, 3)
        headings = np.array([town.lanes[lane].headings[-1] for lane in self.lines])
        self.along = np.column_stack((np.cos(headings), np.sin(headings)))
        self.halves = np.array([town.lanes[lane].widths[-1] / 2 for lane in self.lines])
        self.stood: set[int] = set()
        self.last = {WorldEventKind.OFF_ROAD: NOT_YET, WorldEventKind.WRONG_WAY: NOT_YET}
        self.lanes = [network.get_lane(index) for index in network.lanes_dict()]

    def look(self, poses: Array, frame: int) -> list[WorldEvent]:
        found: list[WorldEvent] = []
        before = self._to_lines(poses[0])
        for k in range(1, len(poses)):
            now = self._to_lines(poses[k])
            found += self._at_lines(poses[k], before, now, frame + k)
            before = now
            if not poses[k, 5]:
                found += self._beside_lanes(poses[k], frame + k)
        front = poses[-1, :2] + LENGTH / 2 * np.array([math.cos(poses[-1, 2]), math.sin(poses[-1, 2])])
        self.stood = {j for j in self.stood if math.hypot(*(front - self.ends[j, :2])) < FORGET}
        return found

    def _to_lines(self, pose: Array) -> tuple[Array, Array, Array, bool]:
        """Of the front to each line (m,): way beyond, distance aside, whether it is on its lane; and if it stands."""
        facing = np.array([math.cos(pose[2]), math.sin(pose[2])])
        off = pose[:2] + LENGTH / 2 * facing - self.ends[:, :2]
        beyond = (off * self.along).sum(axis=1)
        across = off[:, 1] * self.along[:, 0] - off[:, 0] * self.along[:, 1]
        on = (
            (self.along @ facing > 0.5)
            & (np.abs(across) <= self.halves)
            & (np.abs(pose[4] - self.ends[:, 2]) <= LEVEL_HEIGHT)
        )
        return beyond, np.abs(across), on, bool(pose[3] < TRAFFIC_STANDING)

    def _at_lines(
        self, pose: Array, before: tuple[Array, Array, Array, bool], now: tuple[Array, Array, Array, bool], frame: int
    ) -> list[WorldEvent]:
        if before[3]:
            self.stood |= set(np.flatnonzero(before[2] & (before[0] <= 0.0) & (before[0] >= -AT_LINE)).tolist())
        passed = now[2] & (before[0] <= 0.0) & (now[0] > 0.0)
        if pose[5] or not passed.any():
            return []
        j = int(np.argmin(np.where(passed, now[1], np.inf)))
        lane, stood = self.lines[j], j in self.stood
        signal = self.signals[lane]
        self.stood.discard(j)
        if signal.kind is SignalKind.STOP:
            kind, other, broken = WorldEventKind.STOP_SIGN, ObjectClass.TRAFFIC_SIGN, not stood
        else:
            kind, other = WorldEventKind.RED_LIGHT, ObjectClass.TRAFFIC_LIGHT
            broken = self.town.light(lane, (frame - 1) / FRAME_RATE) is LightColour.RED
        if not broken:
            return []
        station = self.town.lanes[lane].length
        return [_event(kind, frame, lane, station, *pose[:2].tolist(), key=signal.id, other=other.label)]

    def _beside_lanes(self, pose: Array, frame: int) -> list[WorldEvent]:
        x, y, heading, _, height, _ = pose.tolist()
        places = [(*self._on(lane, x, y, heading), lane) for lane in self.lanes if self._near(lane, x, y, height)]
        on = [runs_with for out, _, runs_with, _ in places if out <= 0.0]
        outside = min((out for out, *_ in places), default=math.inf)
        broken = {
            WorldEventKind.OFF_ROAD: outside > OFF_ROAD_MARGIN,
            WorldEventKind.WRONG_WAY: bool(on) and not any(on),
        }
        found = []
        for kind in (kind for kind, is_broken in broken.items() if is_broken):
            last, self.last[kind] = self.last[kind], frame
            if frame - last <= BREACH_PAUSE:
                continue
            if places:
                _, station, _, lane = min(places, key=lambda place: place[0])
            else:
                lane = self.network.get_lane(self.network.get_closest_lane_index(np.array([x, y]), height=height))
                station = lane.local_coordinates(np.array([x, y]))[0]
            found.append(_event(kind, frame, lane.town_lane.id, min(max(station, 0.0), lane.length), x, y))
        return found

    def _near(self, lane: PolylineLane, x: float, y: float, height: float) -> bool:
        left, low, right, high = self.network.table.boxes[lane.row]
        if not (left - NEARBY <= x <= right + NEARBY and low - NEARBY <= y <= high + NEARBY):
            return False
        station = lane.local_coordinates(np.array([x, y]))[0]
        return bool(abs(lane.height_at(station) - height) <= LEVEL_HEIGHT)

    def _on(self, lane: PolylineLane, x: float, y: float, heading: float) -> tuple[float, float, bool]:
        """Returns distance outside of a lane, station, and whether the heading is not against the lane."""
        station, lateral = lane.local_coordinates(np.array([x, y]))
        out = max(abs(lateral) - 0.5 * lane.width_at(station), -station, station - lane.length)
        runs_with = lane.town_lane.in_junction or math.cos(heading - lane.heading_at(station)) > AGAINST
        return out, station, runs_with


def _event(
    kind: WorldEventKind, frame: int, lane: int, station: float, x: float, y: float,
    key: int | None = None, other: str | None = None,
) -> WorldEvent:  # fmt: skip
    place = {"lane": lane, "station": round(float(station), 2), "x": round(x, 3), "y": round(y, 3)}
    return WorldEvent(frame=frame, kind=kind, data={**place, "key": key, "other": other})


def lawless_way(network: TownNetwork, rng: np.random.Generator, frames: int) -> Array:
    """Poses (frames + 1, 6) of a car that goes along lanes, some time backwards, off them, standing, or jumping."""
    town = network.town
    lane, station = town.lanes[int(rng.integers(len(town.lanes)))], 0.0
    speed, lateral, drift, turned = 8.0, 0.0, 0.0, 0.0
    poses = np.zeros((frames + 1, 6))
    turning = 0
    for k in range(frames + 1):
        if rng.random() < 0.01:
            drift = float(rng.choice([0.0, 0.0, 0.1, -0.1, 0.04, -0.04]))
        if rng.random() < 0.01:
            turned = float(rng.choice([0.0, 0.0, 0.0, math.pi, 2.2, -2.0]))
        if rng.random() < 0.02:
            speed = float(rng.choice([0.0, 0.2, 4.0, 8.0, 14.0]))
        if rng.random() < 0.003:
            turning = 40
        if rng.random() < 0.004:
            lane = town.lanes[int(rng.integers(len(town.lanes)))]
            station = float(rng.uniform(0.0, lane.length))
        turning = max(turning - 1, 0)
        lateral = 0.985 * lateral + drift
        station += speed / FRAME_RATE
        while station > lane.length:
            station -= lane.length
            after = town.successors(lane.id)
            lane = town.lanes[after[int(rng.integers(len(after)))].target] if after else lane
        if speed == 0.0 and rng.random() < 0.05:  # stands just before the line
            station = max(lane.length - LENGTH / 2 - float(rng.uniform(0.0, 5.0)), 0.0)
        heading = lane.heading_at(station)
        poses[k] = (
            *lane.position(station, lateral),
            heading + turned + rng.normal(0.0, 0.03),
            speed,
            lane.height_at(station),
            turning > 0,
        )
    return poses
