"""Perception of the recorded surroundings from the car.

As in the environment, objects within the sight distance are perceived in all directions: 80 m on a clear day, less in
fog, rain and darkness (`dorothie_gym.sim.sensing.visibility`; recorded headlights count). The random parts of the
environment's perception are left out: glimpses beyond the sight distance and position errors. The state of a traffic
light is perceived within the sight distance when the car drives towards it. Positions are relative to the car's pose at
the frame of the record.
"""

from __future__ import annotations

import enum
import functools
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.session.recording.surroundings import SceneTable, Surroundings
from dorothie_gym.sim.sensing.visibility import CLEAR_SIGHT
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session

Array: TypeAlias = NDArray[np.float64]
Switches: TypeAlias = Sequence[tuple[int, bool]]
"""Frames at which the headlights were switched, and whether on."""


class ObjectKind(enum.IntEnum):
    """Kind of a perceived object: the first five as `ActorKind`, the others traffic lights by state."""

    OTHER = 0
    VEHICLE = 1
    CYCLIST = 2
    PEDESTRIAN = 3
    PROP = 4
    LIGHT_GREEN = 5
    LIGHT_YELLOW = 6
    LIGHT_RED = 7


OBJECT_VALUES: Final = ("distance", "bearing", "ahead", "aside", "heading", "speed", "length", "width")
"""Columns of `Objects.values`: distance [m], bearing [degrees, positive left of the car's heading], the same position
in metres ahead and to the left, heading relative to the car's [degrees, positive left], speed [m/s], length and width
[m]; for a light, distance, bearing and position are those of its stop line, and the rest is 0."""

MAX_OBJECTS: Final = 64
"""Maximum number of objects of a perception, the nearest ones: more than any batch uses."""

MAX_LIGHT_ANGLE: Final = 90.0
"""Largest angle between the car's heading and the lane of a visible light [degrees]."""


def perceived(
    scene: Surroundings, pose: Array, frames: NDArray[np.int64], switches: Switches, town: Town | None
) -> Iterator[tuple[int, NDArray[np.int64], Array]]:
    """Yields for each perception the frame (int), kinds (k,) and values (k, 8) of the objects, the nearest first.

    Args:
        scene: recorded surroundings of the car.
        pose: (n, 3) x, y [m] and heading [degrees, clockwise] of the car.
        frames: (n,) frames of the poses, ascending, including those of the scene.
        switches: switches of the headlights, which are off at first.
        town: the town, if known, for the positions of the traffic lights.
    """
    looks = scene.actors.frames
    at = pose[np.searchsorted(frames, looks)].reshape(-1, 3)
    sight = _sights(scene.weather, switches, looks)
    actors, lights = _actors(scene.actors, at), _lights(scene, looks, at, town)
    owner = np.concatenate([actors[0], lights[0]])
    kind = np.concatenate([actors[1], lights[1]])
    values = np.concatenate([actors[2], lights[2]])
    seen = values[:, 0] <= sight[owner]
    owner, kind, values = owner[seen], kind[seen], values[seen]
    order = np.lexsort((kind, values[:, 0], owner))
    kind, values = kind[order], values[order]
    ends = np.cumsum(np.bincount(owner, minlength=len(looks)))
    for look, (frame, stop) in enumerate(zip(looks.tolist(), ends.tolist(), strict=True)):
        start = int(ends[look - 1]) if look else 0
        chosen = slice(start, min(stop, start + MAX_OBJECTS))
        yield frame, kind[chosen], values[chosen]


def last_perceived(session: Session, frame: int, town: Town | None) -> tuple[NDArray[np.int64], Array]:
    """Returns kinds (k,) and values (k, 8) of the last look before a frame; k is 0 without a look.

    Args:
        session: the session so far.
        frame: looks of this frame and later ones do not count.
        town: as in `perceived`.
    """
    scene, trajectory = session.scene, session.trajectory
    look = _last(scene.actors, frame - 1)
    row = int(np.searchsorted(trajectory["frame"], look.frames[0])) if len(look) else len(trajectory)
    if row == len(trajectory):
        return np.empty(0, dtype=np.int64), np.empty((0, len(OBJECT_VALUES)))
    there = trajectory[row : row + 1]
    pose = np.stack([there["x"], there["y"], np.degrees(there["heading"])], axis=1)
    now = int(look.frames[0])
    scene = Surroundings(actors=look, lights=_last(scene.lights, now), weather=_last(scene.weather, now))
    (_, kinds, values), *_ = perceived(scene, pose, look.frames, light_switches(session), town)
    return kinds, values


def light_switches(session: Session) -> Switches:
    """Returns the frames at which the headlights were switched, and whether on."""
    switched = [act for act in session.physical_actions if act.action is PhysicalAction.LIGHT_CHANGE]
    return [(act.frame, bool(act.up)) for act in switched]


def _last(table: SceneTable, frame: int) -> SceneTable:
    """Returns a table of the last record at or before a frame."""
    k = int(np.searchsorted(table.frames, frame, side="right")) - 1
    if k < 0:
        return SceneTable(table.frames[:0], table.offsets[:1], table.rows[:0])
    start, stop = int(table.offsets[k]), int(table.offsets[k + 1])
    return SceneTable(table.frames[k : k + 1], np.array([0, stop - start]), table.rows[start:stop])


def _actors(table: SceneTable, at: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Returns look, kind and values of every recorded actor."""
    owner = np.repeat(np.arange(len(table)), np.diff(table.offsets))
    rows = table.rows
    values = np.zeros((len(rows), len(OBJECT_VALUES)))
    values[:, :4] = _relative(np.stack([rows["x"], rows["y"]], axis=1), at[owner])
    values[:, 4] = _wrap(at[owner, 2] - np.degrees(rows["heading"]))
    for column, name in enumerate(("speed", "length", "width"), start=5):
        values[:, column] = rows[name]
    return owner, rows["kind"].astype(np.int64), values


def _lights(
    scene: Surroundings, looks: NDArray[np.int64], at: Array, town: Town | None
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Returns look, kind and values of the lights that the car drives towards."""
    table, lines = scene.lights, {} if town is None else stop_lines(town)
    record = np.searchsorted(table.frames, looks, side="right") - 1  # the last before each look
    sizes = np.where(record >= 0, np.diff(table.offsets, append=table.offsets[-1:])[record], 0) if len(table) else None
    if sizes is None or not lines:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty((0, len(OBJECT_VALUES)))
    owner = np.repeat(np.arange(len(looks)), sizes)
    first = np.cumsum(sizes) - sizes
    rows = table.rows[np.arange(len(owner)) - first[owner] + table.offsets[record][owner]]
    numbers = np.array(sorted(lines))
    place = np.searchsorted(numbers, rows["signal"]).clip(max=len(numbers) - 1)
    line = np.array([lines[number] for number in numbers.tolist()])[place]  # (m, 3)
    values = np.zeros((len(rows), len(OBJECT_VALUES)))
    values[:, :4] = _relative(line[:, :2], at[owner])
    aslant = np.abs(_wrap(at[owner, 2] - line[:, 2]))
    shown = (numbers[place] == rows["signal"]) & (aslant < MAX_LIGHT_ANGLE) & (values[:, 2] > 0.0)
    return owner[shown], ObjectKind.LIGHT_GREEN + rows["state"][shown].astype(np.int64), values[shown]


@functools.lru_cache(maxsize=16)
def stop_lines(town: Town) -> Mapping[int, tuple[float, float, float]]:
    """Returns the end of each light's first lane, by id of the light: x, y [m], heading [degrees, clockwise]."""
    lit = {signal for programme in town.programmes for signal in programme.signals}
    lines = {}
    for signal in town.signals:
        if signal.id in lit and signal.lanes:
            lane = town.lanes[signal.lanes[0]]
            lines[signal.id] = (*lane.points[-1, :2].tolist(), float(np.degrees(lane.headings[-1])))
    return MappingProxyType(lines)


def _relative(places: Array, at: Array) -> Array:
    """Returns distance [m], bearing [degrees, positive left], metres ahead and to the left of positions (m, 4)."""
    dx, dy = (places - at[:, :2]).T
    heading = np.radians(at[:, 2])
    ahead = pn.cos(heading) * dx + pn.sin(heading) * dy
    left = pn.sin(heading) * dx - pn.cos(heading) * dy  # y points south: left of east is north
    return np.stack([pn.hypot(ahead, left), np.degrees(pn.arctan2(left, ahead)), ahead, left], axis=1)


def _wrap(degrees: Array) -> Array:
    return (degrees + 180.0) % 360.0 - 180.0


def _sights(weather: SceneTable, switches: Switches, looks: NDArray[np.int64]) -> Array:
    """Returns the sight distance at each look [m]."""
    record = np.searchsorted(weather.frames, looks, side="right") - 1
    lamps = np.zeros(len(looks), dtype=np.bool_)
    for frame, on in switches:
        lamps[looks >= frame] = on
    found = np.full(len(looks), CLEAR_SIGHT)
    if len(weather):
        distinct, which = np.unique(weather.rows, return_inverse=True)
        for number, on in {*zip(which[record[record >= 0]].tolist(), lamps[record >= 0].tolist(), strict=True)}:
            chosen = (record >= 0) & (which[record] == number) & (lamps == on)
            found[chosen] = _sight(tuple(distinct[number].tolist()), on)
    return found


@functools.lru_cache(maxsize=4096)
def _sight(values: tuple[float, ...], lamps: bool) -> float:
    """Returns the sight distance in a weather [m]; parameters out of range (other corpora) count as on a clear day."""
    weather = Weather()
    for parameter, value in zip(WeatherParameter, values, strict=True):
        try:
            weather.set(parameter, value)
        except OntologyError:
            continue
    return weather.sight(lights=lamps)
