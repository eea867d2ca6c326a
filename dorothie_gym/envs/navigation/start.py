"""Start of the sessions of a batch: rows of its arrays before their first decision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.ad_wizard_trigger import PlansRecord
from dorothie_gym.envs.navigation.continuous_control import CONTINUOUS_FIELDS
from dorothie_gym.envs.navigation.decision_state import DriveArrays, DriveRecord, Stage, row_of
from dorothie_gym.envs.navigation.episode import EpisodeArrays, episode_arrays
from dorothie_gym.policies.ad_wizard import AdWizardConfig
from dorothie_gym.policies.navigation.actions import ACTIONS
from dorothie_gym.policies.navigation.driver_view import DriverArrays, driver_arrays
from dorothie_gym.policies.navigation.instructor import Guidance
from dorothie_gym.policies.navigation.instructor_arrays import InstructorArrays, instructor_arrays
from dorothie_gym.policies.navigation.observation_fields import FIELDS
from dorothie_gym.sim.state.town_arrays import TownArrays, town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, grown, with_room_of
from dorothie_gym.sim.weather import Weather
from dorothie_gym.sim.world_start import OwnArrays
from dorothie_gym.support.compilation.records import empty_records, plain

if TYPE_CHECKING:
    from dorothie_gym.envs.navigation.config import NavigationConfig
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.sim.network.network import TownNetwork

Arrays = TypeVar("Arrays", bound=tuple[Any, ...])


def blank_world(network: TownNetwork, config: NavigationConfig, *, pedals: bool) -> WorldArrays:
    """Returns the arrays of a world that has not started, on a clear noon.

    There is room for the objects that the scripted Ad-Wizard adds in a session: a crowd and a roadblock, as each kind
    of trick is played at most once. Nothing depends on the seed of perception or on the wind: `World` writes both when
    the weather changes.
    """
    world, weather = OwnArrays(network, config.session_config.world).arrays, Weather()
    if config.exceptions > 0.0:
        crowd = AdWizardConfig().crowd_sizes[1]
        world = grown(
            town_arrays(network),
            world,
            vehicles=len(world.vehicles) + crowd,
            pedestrians=len(world.pedestrians) + crowd,
            props=1,
        )
    view = weather.visibility(lights=False)
    plain(world.eye)[0] = (
        0, view.sight, view.fog, view.fog_start, view.rain, view.light, view.lamps, view.clarity, view.is_clear,
    )  # fmt: skip
    plain(world.car)["friction"], plain(world.plan)["manual"] = weather.friction, pedals
    return world


def blank_parts(
    town: Town, limits: SpaceLimits, config: NavigationConfig, *, pedals: bool
) -> tuple[DriverArrays, InstructorArrays, EpisodeArrays, DriveArrays]:
    """Returns the arrays of driver, instructor, episode and decision of a session without a scenario."""
    size, actions = (sum(CONTINUOUS_FIELDS.values()), 0) if pedals else (sum(FIELDS.values()), len(ACTIONS))
    driver = driver_arrays(size, actions, [0] * len(town.streets))
    plain(driver.inputs)["weather"][0] = tuple(Weather().values.values())
    guidance = instructor_arrays(
        subgoals=limits.subgoals, landmarks=limits.landmarks, streets=limits.streets, things=limits.objects
    )
    guidance.now["by_name"] = config.guidance is Guidance.GOALS
    drive = DriveArrays(
        empty_records(DriveRecord, 1),
        np.zeros(limits.landmarks, dtype=np.int32),
        np.full((limits.landmarks, 2), math.inf),
        empty_records(PlansRecord, 1),
    )
    drive.plans["due"] = math.inf
    drive.state["landmark"] = drive.state["goal_lane"] = drive.state["told_lane"] = -1
    drive.state["stage"], drive.state["begins"] = Stage.GUIDING, True
    return driver, guidance, episode_arrays(config), drive


def write_scenario(
    scenario: Scenario,
    costs: Sequence[int],
    number: int,
    drivers: DriverArrays,
    guidances: InstructorArrays,
    drives: DriveArrays,
) -> None:
    """Writes a scenario into the row of a session that has not begun.

    Args:
        scenario: the scenario.
        costs: row of the costs to each landmark.
        number: the row.
        drivers: arrays of all drivers.
        guidances: arrays of all instructors.
        drives: arrays of all decisions.
    """
    streets, landmarks = len(scenario.street_names), scenario.storyboard.landmarks[: len(costs)]
    drivers.streets[number] = [name.value for name in scenario.street_names]
    guidances.names[number, :streets] = drivers.streets[number]
    known = {(landmark.lane, landmark.station) for landmark in landmarks if not landmark.hidden}
    plain(guidances.marks)[number, : len(costs)] = [
        (mark.station, mark.lane, mark.name.value, (mark.lane, mark.station) in known) for mark in landmarks
    ]
    drives.waypoints[number, : len(costs)] = [mark.waypoint for mark in landmarks]
    drives.rows[number, : len(costs)] = costs


class Blanks:
    """Arrays of sessions that have not begun, to be copied into the rows of a batch."""

    def __init__(self, stacks: Sequence[tuple[Any, ...]], blanks: Sequence[tuple[Any, ...]]) -> None:
        """Prepares the copies.

        Args:
            stacks: named tuples of arrays with a leading axis.
            blanks: the same of arrays without it.
        """
        pairs = [pair for stack, blank in zip(stacks, blanks, strict=True) for pair in zip(stack, blank, strict=True)]
        # byte by byte: NumPy leaves out the bytes between the fields of records
        self._pairs = [(_bytes_of(rooms, len(rooms)), _bytes_of(blank, 1)[0]) for rooms, blank in pairs if blank.nbytes]

    def write(self, number: int) -> None:
        """Writes a row."""
        for rows, blank in self._pairs:
            rows[number] = blank


def _bytes_of(array: NDArray[np.generic], rows: int) -> NDArray[np.uint8]:
    return np.asarray(array).reshape(rows, -1).view(np.ndarray).view(np.uint8)


def stacked(arrays: Arrays, count: int) -> Arrays:
    """Returns a tuple of arrays with a leading axis, of `count` copies."""
    rooms = [np.zeros((count, *array.shape), dtype=array.dtype) for array in arrays]
    stack = type(arrays)(*(room.view(np.recarray) if room.dtype.names else room for room in rooms))
    for number in range(count):
        copy_row(row_of(stack, number), arrays)
    return stack


def with_room(town: TownArrays, worlds: WorldArrays, row: WorldArrays) -> WorldArrays:
    """Returns the arrays of all worlds with the room of a row, which has at least that of theirs."""
    if len(row.order) == worlds.order.shape[1]:  # only paths are longer
        pairs = zip(worlds.plain(), row.plain(), strict=True)
        return WorldArrays._make(_widened(rooms, array.shape) for rooms, array in pairs)
    wider = stacked(row, len(worlds.clock))
    for number in range(len(worlds.clock)):
        copy_row(row_of(wider, number), with_room_of(town, row_of(worlds, number), row))
    return wider


def _widened(rooms: NDArray[np.generic], shape: tuple[int, ...]) -> NDArray[np.generic]:
    """Returns the arrays of all worlds with rows of another shape, which is as long at least."""
    wider = rooms
    if rooms.shape[1:] != shape:
        wider = np.zeros((len(rooms), *shape), dtype=rooms.dtype)
        wider[:, : rooms.shape[1]] = rooms
    return wider.view(np.recarray) if wider.dtype.names else wider


def copy_row(row: tuple[Any, ...], arrays: tuple[Any, ...]) -> None:
    """Copies arrays byte by byte into a row of a batch."""
    for target, source in zip(row, arrays, strict=True):
        np.copyto(np.asarray(target).view(np.uint8), np.ascontiguousarray(source).view(np.uint8))
