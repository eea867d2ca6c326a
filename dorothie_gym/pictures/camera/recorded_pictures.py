"""Pictures of recorded sessions, drawn again from their frames.

A record has places, headings, speeds and sizes of all bodies. The rest is derived: heights from the lanes, gait from
the distances between records, brake lights from falling speeds.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from dorothie_gym.archive.actor_tracks import ActorTracks, Moment
from dorothie_gym.archive.recorded_perception import Switches, light_switches
from dorothie_gym.errors import OntologyError, SessionError
from dorothie_gym.ontology.spellings import parse_landmark, parse_sensor
from dorothie_gym.ontology.world_exceptions import Sensor, WeatherParameter
from dorothie_gym.pictures.camera.body_snapshots import BodySnapshot
from dorothie_gym.pictures.camera.range_sensors import CarState
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.scenery.lots import Lot
from dorothie_gym.pictures.camera.session_camera import EarlierWorld, SessionCamera
from dorothie_gym.pictures.camera.solid_boxes import SolidBoxes, solid_boxes
from dorothie_gym.pictures.camera.town_scene import SessionScene, TownScene
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.session.recording.street_titles import recorded_labels
from dorothie_gym.session.recording.surroundings import LIGHT_STATES, ActorKind
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.network.lane_lookup import closest_lane, value_near
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.pedestrians.walking import PACE
from dorothie_gym.sim.sensing.visibility import CLARITY
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.records import PedestrianRecord, PropRecord, VehicleRecord
from dorothie_gym.sim.state.town_arrays import TownArrays, town_arrays
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import Record, RecordArray, empty_records, plain
from dorothie_gym.support.portable_math import wrap_radians
from dorothie_gym.tasks.landmark_designs import site_key
from dorothie_gym.tasks.storyboard import Landmark

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import LightColour, Town
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.pictures.camera.pose import CameraPose
    from dorothie_gym.pictures.camera.range_sensors import Lidar, Radar, Returns
    from dorothie_gym.session.config import CameraConfig
    from dorothie_gym.session.recording.header import LandmarkRow
    from dorothie_gym.session.recording.session import Session
    from dorothie_gym.sim.sensing.visibility import Visibility

_KINDS = {ActorKind.VEHICLE: Kind.CAR, ActorKind.CYCLIST: Kind.CYCLIST}
_NO_BODY = -1
_SAME_PLACE = 1.0  # [m] between a recorded landmark and its site
_OWN_LOT = 6.0, 5.0  # [m] length and depth of the lot of a landmark without a site in the town


class RecordedPictures:
    """Pictures of the camera on the car of a recorded session, at any frame between its first and last.

    Bodies are interpolated between records. They keep their keys, and thus their appearance; keys of other corpora that
    are not positive 32-bit numbers are replaced by 1, 2, ... in their order. A picture depends on its frame only.

    Attributes:
        camera: the camera.
        actors: (m,) recorded actors, rows of `ACTOR_DTYPE`.
        keys: (m,) int32 key of each actor in pictures.
        first_frame: first frame of the car (30 Hz).
        last_frame: last frame of the car (30 Hz).

    Raises:
        SessionError: the session has no frames of the car, or no surroundings.
    """

    def __init__(self, session: Session, town: Town, config: CameraConfig) -> None:
        """Prepares the pictures.

        Args:
            session: recorded session.
            town: its town.
            config: settings of the camera.
        """
        self._session, self._town = session, town
        rows, scene = session.trajectory, session.scene
        if not len(rows):
            raise SessionError(f"{session.name}: has no frames of the car; no pictures can be drawn")
        if not len(scene.actors):
            raise SessionError(f"{session.name}: has no recorded surroundings (actors); no pictures can be drawn")
        self.first_frame, self.last_frame = int(rows["frame"][0]), int(rows["frame"][-1])
        self._tracks = ActorTracks(scene.actors)
        self.actors = scene.actors.rows
        self.keys = _keys_of(self.actors["key"])
        self._heights, self._odometers = self._follow_tracks()
        self._accelerations = _accelerations_of(self._tracks)
        self._car_heights = self._find_car_heights()
        self._switches, self._faults = light_switches(session), _fault_switches(session)
        self._weathers: dict[bytes, Weather] = {}
        names = recorded_labels(session.header) if len(session.header.street_names) == len(town.streets) else ()
        lots, landmarks = _placed_landmarks(session.header.landmarks, town, town_scene(town))
        self.camera = SessionCamera(SessionScene(lots, names, landmarks), config)

    def frames(self, rate: float) -> range:
        """Returns the frames of pictures at a rate, at most 30 [1/s]: multiples of a whole number, as decisions are."""
        step = max(round(FRAME_RATE / rate), 1)
        first = -(-self.first_frame // step) * step
        return range(first if first <= self.last_frame else self.first_frame, self.last_frame + 1, step)

    def pictures(self, rate: float) -> Iterator[tuple[int, CameraFrame]]:
        """Yields the frames at a rate [1/s] with their pictures."""
        for frame in self.frames(rate):
            yield frame, self.picture(frame)

    def picture(self, frame: int, *, since: int | None = None) -> CameraFrame:
        """Returns the picture at a frame (30 Hz); beyond the first and last frame that of the nearest.

        The exceptions and actions of the frame itself show afterwards, as in the session.

        Args:
            frame: the frame.
            since: frame from which optical flow is measured; None for no movement.
        """
        frame = min(max(frame, self.first_frame), self.last_frame)
        before = None
        if since is not None:
            car = self.car(since)
            before = EarlierWorld(car.x, car.y, car.height, car.heading, self.bodies(since))
        return self.camera.render_from(
            self.pose(frame),
            self.bodies(frame),
            self.weather(frame),
            time=frame / FRAME_RATE,
            head_lights=_last_switch(self._switches, frame),
            faults=self._faulty(frame),
            own=_NO_BODY,
            traffic_lights=self._traffic_lights(frame),
            before=before,
        )

    def lidar_turn(self, frame: int, lidar: Lidar) -> Returns:
        """Returns the whole turn of a lidar on the scene of `camera` at a frame, as `Lidar.turn`."""
        return lidar.turn(
            self.car(frame), self.bodies(frame), self.weather(frame), faults=self._faulty(frame), own=_NO_BODY
        )

    def radar_detections(self, frame: int, radar: Radar) -> NDArray[np.float32]:
        """Returns the detections of a radar on the scene of `camera` at a frame, as `Radar.detections`."""
        return radar.detections(self.car(frame), self.bodies(frame), self.weather(frame), own=_NO_BODY)

    def solid_boxes(self, frame: int) -> SolidBoxes:
        """Returns the 3D boxes of the bodies near the car at a frame, hidden ones included."""
        placed = self.camera.placed(self.pose(frame), self.bodies(frame), self.weather(frame), own=_NO_BODY)
        return solid_boxes(self.camera.scene.camera_scene.bank, placed)

    def pose(self, frame: int) -> CameraPose:
        """Returns the pose of the camera at a frame."""
        car = self.car(frame)
        return self.camera.pose_on(car.x, car.y, car.height, car.heading)

    def car(self, frame: int) -> CarState:
        """Returns the state of the car at a frame."""
        rows = self._session.trajectory
        k = max(int(np.searchsorted(rows["frame"], frame, side="right")) - 1, 0)
        after = min(k + 1, len(rows) - 1)
        steps = int(rows["frame"][after] - rows["frame"][k])
        share = (frame - int(rows["frame"][k])) / steps if steps else 0.0
        here, there = rows[k], rows[after]
        x, y, speed = (float(here[name] + share * (there[name] - here[name])) for name in ("x", "y", "speed"))
        height = float(self._car_heights[k] + share * (self._car_heights[after] - self._car_heights[k]))
        heading = float(here["heading"])
        if share:
            heading += share * wrap_radians(float(there["heading"]) - heading)
        return CarState(x, y, height, heading, speed)

    def weather(self, frame: int) -> Weather:
        """Returns the last recorded weather at a frame; a clear noon if there is none."""
        record = self._session.scene.weather.at(frame)
        if record is None or not len(record):
            return Weather()
        key = record[:1].tobytes()
        if key not in self._weathers:
            weather = self._weathers[key] = Weather()
            for parameter, value in zip(WeatherParameter, record[0].tolist(), strict=True):
                try:
                    weather.set(parameter, min(max(value, parameter.low), parameter.high))
                except OntologyError:
                    continue
        return self._weathers[key]

    def visibility(self, frame: int) -> Visibility:
        """Returns the visibility at a frame, by weather, light and faults of the view."""
        clarity = min((CLARITY.get(sensor, 1.0) for sensor in self._faulty(frame)), default=1.0)
        return self.weather(frame).visibility(lights=_last_switch(self._switches, frame), clarity=clarity)

    def _faulty(self, frame: int) -> list[Sensor]:
        return [sensor for sensor, switches in self._faults.items() if _last_switch(switches, frame)]

    def bodies(self, frame: int) -> BodySnapshot:
        """Returns the bodies at a frame."""
        moment = self._tracks.at(frame)
        actors, kinds = self._tracks.actors(moment), self._tracks.table.rows["kind"][moment.rows]
        odometers = _between(self._odometers, moment)
        if moment.share < 0.0:
            odometers = np.maximum(odometers + moment.seconds * np.abs(actors["speed"]), 0.0)
        columns: dict[str, NDArray[np.generic]] = {
            **{name: actors[name] for name in ("x", "y", "heading", "speed", "length", "width")},
            "cos": pn.cos(actors["heading"]),
            "sin": pn.sin(actors["heading"]),
            "key": self.keys[moment.rows],
            "height": _between(self._heights, moment),
            "odometer": odometers,
            "acceleration": _between(self._accelerations, moment),
        }
        driving = np.isin(kinds, [int(kind) for kind in _KINDS])
        walking, standing = kinds == int(ActorKind.PEDESTRIAN), kinds == int(ActorKind.PROP)
        vehicles = _records(VehicleRecord, columns, driving)
        plain(vehicles)["kind"] = np.where(kinds[driving] == int(ActorKind.CYCLIST), int(Kind.CYCLIST), int(Kind.CAR))
        pedestrians = _records(PedestrianRecord, columns, walking)
        plain(pedestrians)["state"] = int(Walk.WALKING)
        props = _records(PropRecord, columns, standing)
        plain(props)["present"] = True
        return BodySnapshot(vehicles, pedestrians, props)

    def _traffic_lights(self, frame: int) -> Mapping[int, LightColour] | None:
        """Returns the recorded states of the traffic lights; None where none are recorded."""
        rows = self._session.scene.lights.at(frame)
        if rows is None or not len(rows):
            return None
        return {signal: LIGHT_STATES[state] for signal, state in rows.tolist()}

    def _follow_tracks(self) -> tuple[Array, Array]:
        """Returns the height of the road under each row of the actors (m,), and its distance since it appeared [m]."""
        tracks, rows = self._tracks, self._tracks.table.rows
        heights, odometers = np.zeros(len(rows)), np.zeros(len(rows))
        x, y, heading = (np.ascontiguousarray(rows[name]) for name in ("x", "y", "heading"))
        driven = _moved_before(self._tracks) * np.abs(rows["speed"])
        town = town_arrays(network_of(self._town))
        _follow(town, x, y, heading, tracks.before, driven, heights, odometers)
        walking = rows["kind"] == int(ActorKind.PEDESTRIAN)
        if not town.flat and walking.any():
            heights[walking] = _footway_heights(town, x[walking], y[walking])
        return heights, odometers

    def _find_car_heights(self) -> Array:
        """Returns the height of the road under the car in each row of the trajectory (n,) [m]."""
        rows, lanes = self._session.trajectory, self._town.lanes
        heights, odometers = np.zeros(len(rows)), np.zeros(len(rows))
        town = town_arrays(network_of(self._town))
        if town.flat:
            return heights
        x, y, heading = (np.ascontiguousarray(rows[name]) for name in ("x", "y", "heading"))
        before = np.arange(-1, len(rows) - 1)
        _follow(town, x, y, heading, before, np.zeros(len(rows)), heights, odometers)
        for k, lane in enumerate(rows["lane"].tolist()):
            if 0 <= lane < len(lanes):  # of several lanes above each other, the one that it follows
                heights[k] = lanes[lane].height_at(lanes[lane].project(np.array([x[k], y[k]]))[0])
        return heights


def _keys_of(recorded: NDArray[np.int64]) -> NDArray[np.int32]:
    """Returns keys (m,) that can be instances in pictures."""
    if len(recorded) and not (recorded.min() > 0 and recorded.max() <= np.iinfo(np.int32).max):
        recorded = 1 + np.unique(recorded, return_inverse=True)[1]
    return recorded.astype(np.int32)


def _between(column: Array, moment: Moment) -> Array:
    here = column[moment.rows]
    return np.asarray(here + max(moment.share, 0.0) * (column[moment.after] - here))


def _records(
    kind: type[Record], columns: Mapping[str, NDArray[np.generic]], chosen: NDArray[np.bool_]
) -> RecordArray[Record]:
    """Returns records with the columns that they have."""
    records = empty_records(kind, int(chosen.sum()))
    table = plain(records)
    for name in set(columns) & set(table.dtype.names or ()):
        table[name] = columns[name][chosen]
    return records


def _accelerations_of(tracks: ActorTracks) -> Array:
    """Returns the change of speed around each row (m,) [m/s^2]."""
    rows = np.arange(len(tracks.times))
    first = np.where(tracks.before >= 0, tracks.before, rows)
    last = np.where(tracks.after >= 0, tracks.after, rows)
    speed, seconds = tracks.table.rows["speed"], tracks.times[last] - tracks.times[first]
    return np.asarray((speed[last] - speed[first]) / np.where(seconds > 0.0, seconds, math.inf))


def _moved_before(tracks: ActorTracks) -> Array:
    """Returns the time for which the actor of each row has probably moved since it appeared (m,) [s].

    Actors of the first record have existed since frame 0, where pedestrians start to walk one after another.
    """
    first = slice(int(tracks.table.offsets[0]), int(tracks.table.offsets[1]))
    walking = tracks.table.rows["kind"][first] == int(ActorKind.PEDESTRIAN)
    frames = np.full(len(tracks.times), 0.5 * float(np.median(np.diff(tracks.table.frames, prepend=0))))
    frames[first] = tracks.table.frames[0]
    frames[first][walking] -= -np.arange(int(walking.sum())) % PACE
    return np.asarray(np.maximum(frames, 0.0) / FRAME_RATE)


def _footway_heights(town: TownArrays, x: Array, y: Array) -> Array:
    """Returns the heights (n,) of the closest footway or crosswalk to places [m]."""
    walks, points = plain(town.walks), town.walk_points
    inner = np.concatenate([np.arange(first, last) for first, last in zip(walks["first"], walks["last"], strict=True)])
    across = plain(town.crossings)
    begin = np.concatenate((points[inner][:, [0, 1, 4]], _ends(across, 0)))  # x, y, height
    end = np.concatenate((points[inner + 1][:, [0, 1, 4]], _ends(across, 1)))
    lines = np.asarray(shapely.linestrings(np.stack((begin[:, :2], end[:, :2]), axis=1)), dtype=np.object_)
    places = shapely.points(x, y)
    closest = shapely.STRtree(lines).nearest(places)
    share = shapely.line_locate_point(lines[closest], places, normalized=True)
    share = np.nan_to_num(share)  # of lines without a length
    return np.asarray(begin[closest, 2] + share * (end[closest, 2] - begin[closest, 2]))


def _ends(crossings: NDArray[np.void], end: int) -> Array:
    """Returns x, y and height (n, 3) of one end of crosswalks [m]."""
    return np.column_stack((crossings["x"][:, end], crossings["y"][:, end], crossings["height"]))


@compiled
def _follow(
    town: TownArrays,
    x: Array,
    y: Array,
    heading: Array,
    before: NDArray[np.int64],
    begun: Array,
    heights: Array,
    odometers: Array,
) -> None:
    """Writes heights and distances of the rows (m,) of actors, those of earlier records first.

    Args:
        town: arrays of the town.
        x: [m].
        y: [m].
        heading: [rad].
        before: row of the same actor in the previous record, -1 for none.
        begun: distance of rows without one [m].
        heights: receives the heights [m].
        odometers: receives the driven distances [m].
    """
    for k in range(len(x)):
        last = before[k]
        height, odometers[k] = math.nan, begun[k]
        if last >= 0:
            height = heights[last]
            odometers[k] = odometers[last] + math.sqrt((x[k] - x[last]) ** 2 + (y[k] - y[last]) ** 2)
        if not town.flat:
            lane, station, _, segment = closest_lane(
                town, x[k], y[k], heading[k], pm.cos(heading[k]), pm.sin(heading[k]), height, 0
            )
            heights[k] = value_near(town.points, town.lanes[lane], segment, 4, station)


# --- Exceptions and landmarks -----------------------------------------------------------------------------------------


def _fault_switches(session: Session) -> dict[Sensor, list[tuple[int, bool]]]:
    """Returns the frames at which the fault of each sensor began and ended."""
    switches: dict[Sensor, list[tuple[int, bool]]] = {}
    for event in session.of_type(EventType.EXCEPTION):
        name = event.data.get("sensor")
        if isinstance(name, str):
            try:
                sensor = parse_sensor(name)
            except OntologyError:
                continue  # of another corpus
            switches.setdefault(sensor, []).append((event.frame, bool(event.data.get("on"))))
    return switches


def _last_switch(switches: Switches, frame: int) -> bool:
    """Returns the state set by the last switch before a frame; False without one."""
    return next((on for at, on in reversed(switches) if at < frame), False)


def _placed_landmarks(rows: Sequence[LandmarkRow], town: Town, scene: TownScene) -> tuple[TownScene, list[Landmark]]:
    """Returns the landmarks of a header at the sites of the town.

    Landmarks without a site, as in other corpora, have additional lots in the returned scene.
    """
    lots, landmarks = list(scene.lots), []
    for index, row in enumerate(rows):
        site = next(
            (
                site.id
                for site in town.sites
                if pm.hypot(site.position[0] - row["x"], site.position[1] - row["y"]) < _SAME_PLACE
            ),
            None,
        )
        known = 0 <= row["lane"] < len(town.lanes)
        stop = town.lanes[row["lane"]].position(row["station"]) if known else np.array([row["x"], row["y"]])
        waypoint = float(stop[0]), float(stop[1])
        if site is None:
            site = len(lots)
            lots.append(_own_lot(site, (row["x"], row["y"]), waypoint, town.name))
        name = parse_landmark(row["name"])
        landmarks.append(
            Landmark(
                index=index, name=name, label=name.label, category="", site=site, lane=row["lane"],
                station=row["station"], position=(row["x"], row["y"]), waypoint=waypoint, street=row["street"],
                hidden=row["hidden"],
            )
        )  # fmt: skip
    return dataclasses.replace(scene, lots=tuple(lots)), landmarks


def _own_lot(number: int, place: tuple[float, float], waypoint: tuple[float, float], town: str) -> Lot:
    """Returns a lot behind a place, as seen from its waypoint on the road."""
    heading = pm.atan2(place[1] - waypoint[1], place[0] - waypoint[0]) if place != waypoint else 0.0
    return Lot(number, place, heading, place, *_OWN_LOT, site_key(town, number))
