"""Arrays of a world: the state that the compiled loops read and write, and the log that they keep of the ego."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.sim.state.codes import NOBODY, U_TURN
from dorothie_gym.sim.state.records import (
    POSE,
    TRACE,
    BreachRecord,
    ClockRecord,
    CoursePointRecord,
    EgoRecord,
    EventRecord,
    EyeRecord,
    GoalRecord,
    LampRecord,
    LaneStepRecord,
    LineMarkRecord,
    LocalizerRecord,
    NodeRecord,
    PedestrianRecord,
    PlanRecord,
    PropRecord,
    SeenRecord,
    SweepRecord,
    VehicleRecord,
    WatchRecord,
)
from dorothie_gym.sim.traffic.lane_index import rebuild
from dorothie_gym.sim.traffic.parameters import COURSE, EVENTS, GOALS, MAX_SUBSTEPS, POINTS, STEPS
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import (
    Record,
    RecordArray,
    by_reference,
    empty_records,
    gives_row,
    plain,
    record_dtype,
)

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays

PROPS = 16
"""Maximum number of props in a world."""

CAR_KEY = 0
"""Key of the ego."""

ROWS = 64
"""Multiple to which the room for a path is rounded up."""

STACK = 32
"""Size of the stack of searches along lanes."""

LONG_AGO = -(1 << 40)
"""A frame before all others."""

BREACHES = MAX_SUBSTEPS + 2
"""Maximum number of infractions in one call of `step`: a line each frame, and the road and the direction left once."""


@by_reference
class WorldArrays(NamedTuple):
    """A world in arrays; copying the arrays copies the world.

    Attributes:
        vehicles: vehicles, the ego the first.
        pedestrians: pedestrians.
        props: props.
        nodes: nodes of the lanes' lists: two for each vehicle and four for each prop, in the lists of the lanes.
        heads: int32 first node of each lane, or -1.
        order: int32 bodies (vehicles, pedestrians, props) as `collisions` sorts them, by `keys`.
        keys: their sort keys [m].
        lamps: one for each light programme.
        busy: int32 number of pedestrians on each crosswalk.
        stack: int32 scratch of searches along lanes.
        starts: the starts of these lanes [m].
        clock: (1,) time and counters.
        car: (1,) control of the ego, if vehicle 0 is of the kind `Kind.DRIVEN`.
        sweeps: directions and sweeps at the points of its path around its place, starting with `EgoRecord.first`.
        plan: (1,) its plan.
        course: points of its whole path.
        steps: lanes of the plan that is being made.
        goals: places where it is expected to stop.
        seen_props: (p, 3) x, y and height of the props that it sees [m].
        eye: (1,) its visibility.
        seen: bodies that it perceives, nearest first.
        trace: (f, 10) its trajectory in the last call of `step`, see `records.TRACE`.
        poses: (f + 1, 6) its poses before that call and after each of its substeps, see `records.POSE`.
        events: its events in that call.
        localizer: (1,) its pose estimate.
        watch: (1,) numbers of its infractions.
        marks: stops of the ego at the lines of the town.
        breaches: infractions of the ego in the last call of `step`, without collisions.
    """

    vehicles: RecordArray[VehicleRecord]
    pedestrians: RecordArray[PedestrianRecord]
    props: RecordArray[PropRecord]
    nodes: RecordArray[NodeRecord]
    heads: NDArray[np.int32]
    order: NDArray[np.int32]
    keys: Array
    lamps: RecordArray[LampRecord]
    busy: NDArray[np.int32]
    stack: NDArray[np.int32]
    starts: Array
    clock: RecordArray[ClockRecord]
    car: RecordArray[EgoRecord]
    sweeps: RecordArray[SweepRecord]
    plan: RecordArray[PlanRecord]
    course: RecordArray[CoursePointRecord]
    steps: RecordArray[LaneStepRecord]
    goals: RecordArray[GoalRecord]
    seen_props: Array
    eye: RecordArray[EyeRecord]
    seen: RecordArray[SeenRecord]
    trace: Array
    poses: Array
    events: RecordArray[EventRecord]
    localizer: RecordArray[LocalizerRecord]
    watch: RecordArray[WatchRecord]
    marks: RecordArray[LineMarkRecord]
    breaches: RecordArray[BreachRecord]

    @property
    def nbytes(self) -> int:
        """Memory of all arrays [bytes]."""
        return sum(array.nbytes for array in self)

    def plain(self) -> list[NDArray[np.generic]]:
        """Returns the arrays as plain NumPy arrays that share their memory."""
        return [np.asarray(array) for array in self]

    def copy(self) -> WorldArrays:
        """Returns a copy of the world."""
        return WorldArrays._make(_copy_of(array) for array in self.plain())

    def __deepcopy__(self, memo: dict[int, object]) -> WorldArrays:
        twin = self.copy()
        memo.update((id(array), copied) for array, copied in zip(self, twin, strict=True))
        return twin

    def __reduce__(self) -> tuple[Callable[..., WorldArrays], tuple[list[tuple[int, ...]], bytes]]:
        arrays = self.plain()
        shapes = [array.shape for array in arrays]
        return _from_bytes, (shapes, b"".join(array.tobytes() + bytes(-array.nbytes % ALIGNMENT) for array in arrays))

    def tobytes(self) -> bytes:
        """Returns the state byte by byte, to compare worlds."""
        return b"".join(array.tobytes() for array in self)


@gives_row
def world_of(batch: WorldArrays, number: int) -> WorldArrays:
    """Returns a world of a batch: views of its arrays, of the same types as those of a single world."""
    return WorldArrays._make(array[number] for array in batch)


def _copy_of(array: NDArray[np.generic]) -> NDArray[np.generic]:
    """Returns a copy with all bytes, also those between the fields of records, which NumPy leaves out."""
    copied = np.empty(array.shape, dtype=array.dtype)
    np.copyto(copied.view(np.uint8), np.ascontiguousarray(array).view(np.uint8))
    return copied.view(np.recarray) if array.dtype.names else copied


ALIGNMENT = 16
"""Alignment of the arrays in the bytes of a pickled world [bytes]."""

_DTYPES = [
    *map(record_dtype, (VehicleRecord, PedestrianRecord, PropRecord, NodeRecord)),
    *map(np.dtype, "iid"),
    record_dtype(LampRecord),
    *map(np.dtype, "iid"),
    *map(record_dtype, (ClockRecord, EgoRecord, SweepRecord, PlanRecord, CoursePointRecord, LaneStepRecord)),
    record_dtype(GoalRecord),
    np.dtype("d"),
    *map(record_dtype, (EyeRecord, SeenRecord)),
    *map(np.dtype, "dd"),
    *map(record_dtype, (EventRecord, LocalizerRecord, WatchRecord, LineMarkRecord, BreachRecord)),
]
"""Types of the arrays of a world, in order."""


def _from_bytes(shapes: Sequence[tuple[int, ...]], data: bytes) -> WorldArrays:
    """Returns a pickled world."""
    block = np.frombuffer(bytearray(data), dtype=np.uint8)
    arrays, start = [], 0
    for shape, dtype in zip(shapes, _DTYPES, strict=True):
        size = math.prod(shape) * dtype.itemsize
        array = block[start : start + size].view(dtype).reshape(shape)
        arrays.append(array.view(np.recarray) if dtype.names else array)
        start += size + -size % ALIGNMENT
    return WorldArrays._make(arrays)


def empty_world(
    town: TownArrays,
    *,
    vehicles: int,
    pedestrians: int,
    props: int = PROPS,
    seed: int | np.random.SeedSequence = 0,
    driven: bool = False,
) -> WorldArrays:
    """Returns an empty world with room for the given number of bodies.

    Args:
        town: arrays of the town.
        vehicles: most vehicles.
        pedestrians: most pedestrians.
        props: most props.
        seed: seed of all random numbers in it.
        driven: whether vehicle 0 will be an ego that follows a path, `Kind.DRIVEN`.
    """
    world = WorldArrays(
        vehicles=empty_records(VehicleRecord, vehicles),
        pedestrians=empty_records(PedestrianRecord, pedestrians),
        props=empty_records(PropRecord, props),
        nodes=empty_records(NodeRecord, 2 * vehicles + 4 * props),
        heads=np.full(len(town.lanes), NOBODY, dtype=np.int32),
        order=np.arange(vehicles + pedestrians + props, dtype=np.int32),
        keys=np.zeros(vehicles + pedestrians + props),
        lamps=empty_records(LampRecord, len(town.programmes)),
        busy=np.zeros(len(town.crossings), dtype=np.int32),
        stack=np.zeros(STACK, dtype=np.int32),
        starts=np.zeros(STACK),
        clock=empty_records(ClockRecord, 1),
        car=empty_records(EgoRecord, 1),
        sweeps=empty_records(SweepRecord, POINTS if driven else 1),
        plan=empty_records(PlanRecord, 1),
        course=empty_records(CoursePointRecord, COURSE if driven else 1),
        steps=empty_records(LaneStepRecord, STEPS if driven else 1),
        goals=empty_records(GoalRecord, GOALS if driven else 1),
        seen_props=np.zeros((props if driven else 0, 3)),
        eye=empty_records(EyeRecord, 1),
        seen=empty_records(SeenRecord, vehicles + pedestrians + props if driven else 1),
        trace=np.zeros((MAX_SUBSTEPS if driven else 1, len(TRACE))),
        poses=np.zeros((1 + MAX_SUBSTEPS if driven else 1, len(POSE))),
        events=empty_records(EventRecord, EVENTS if driven else 1),
        localizer=empty_records(LocalizerRecord, 1),
        watch=empty_records(WatchRecord, 1),
        marks=empty_records(LineMarkRecord, len(town.lines) if driven else 1),
        breaches=empty_records(BreachRecord, BREACHES if driven else 1),
    )
    world.car["closed"] = NOBODY
    world.car["closed_at"] = -math.inf
    world.car["lateral_last"] = world.car["stop_at"] = world.car["roadblock"] = world.car["action_end"] = math.inf
    world.car["hold_speed"] = -1.0
    world.localizer["estimate"][:, 3] = 1.0
    world.watch["last"] = LONG_AGO
    world.nodes["lane"] = world.nodes["next"] = world.nodes["before"] = NOBODY
    world.lamps["until"] = -math.inf
    world.props["lane"] = NOBODY
    world.vehicles["lane"] = world.vehicles["approach"] = world.vehicles["claim"] = world.vehicles["inside"] = NOBODY
    sow(world, seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed))
    return world


def sow(world: WorldArrays, seed: np.random.SeedSequence) -> None:
    """Sets the seed of all random numbers in a world."""
    plain(world.clock)["random"] = int(seed.generate_state(1)[0]) | 1


def grown(town: TownArrays, world: WorldArrays, *, vehicles: int, pedestrians: int, props: int) -> WorldArrays:
    """Returns the same world with more room: all bodies keep their rows and their behaviour.

    Args:
        town: arrays of the town.
        world: arrays of the world, left as they are.
        vehicles: most vehicles.
        pedestrians: most pedestrians.
        props: most props.

    Raises:
        ValueError: this would be less room than there is.
    """
    room, wanted = (len(world.vehicles), len(world.pedestrians), len(world.props)), (vehicles, pedestrians, props)
    if any(more < less for more, less in zip(wanted, room, strict=True)):
        raise ValueError(f"a world with room for {room} vehicles, pedestrians and props does not shrink to {wanted}")
    driven = len(world.sweeps) > 1
    bigger = empty_world(town, vehicles=vehicles, pedestrians=pedestrians, props=props, driven=driven)
    bigger = bigger._replace(course=world.course, steps=world.steps, goals=world.goals).copy()
    for name, old, new in zip(WorldArrays._fields, world.plain(), bigger.plain(), strict=True):
        if name not in ("nodes", "heads", "order", "keys"):  # rebuilt from the bodies, whose numbers they hold
            new[: len(old)] = old
    rebuild(town, bigger)
    return bigger


def with_room_of(town: TownArrays, world: WorldArrays, other: WorldArrays) -> WorldArrays:
    """Returns the same world with at least the room that another one has, for bodies, path and goals."""
    vehicles = max(len(world.vehicles), len(other.vehicles))
    pedestrians = max(len(world.pedestrians), len(other.pedestrians))
    props = max(len(world.props), len(other.props))
    larger = world
    if (vehicles, pedestrians, props) != (len(world.vehicles), len(world.pedestrians), len(world.props)):
        larger = grown(town, world, vehicles=vehicles, pedestrians=pedestrians, props=props)
    return larger._replace(
        course=_extended(larger.course, max(len(larger.course), len(other.course))),
        steps=_extended(larger.steps, max(len(larger.steps), len(other.steps))),
        goals=_extended(larger.goals, max(len(larger.goals), len(other.goals))),
    )


def lengthened(world: WorldArrays) -> WorldArrays:
    """Returns the same world with the room for the path of the ego that was missing last."""
    points = int(plain(world.plan)["needed"][0])
    if points == 0:
        return world._replace(steps=_extended(world.steps, 2 * len(world.steps)))
    room = max(math.ceil(points / ROWS) * ROWS, len(world.course))  # a batch may have made room for another world
    return world._replace(course=_extended(world.course, room))


def _extended(records: RecordArray[Record], count: int) -> RecordArray[Record]:
    rows = np.zeros(count, dtype=records.dtype)
    rows[: len(records)] = np.asarray(records)
    return cast("RecordArray[Record]", rows.view(np.recarray))


# --- Log of the ego: trajectory, poses and events ---------------------------------------------------------------------


@inlined
def trace(world: WorldArrays) -> None:
    """Logs the ego's state after a substep, see `records.TRACE` and `records.POSE`."""
    car, vehicle = world.car[0], world.vehicles[0]
    rows, k = world.trace, int(car.frames)
    car.frames += 1
    rows[k, 0], rows[k, 1], rows[k, 2] = world.clock[0].frame, vehicle.x, vehicle.y
    rows[k, 3], rows[k, 4] = vehicle.heading, vehicle.speed
    rows[k, 5], rows[k, 6], rows[k, 7], rows[k, 8] = car.throttle, car.steer, car.brake, car.run_lane[car.run]
    rows[k, 9] = car.offset
    note_pose(world, k + 1)


@inlined
def note_pose(world: WorldArrays, k: int) -> None:
    """Logs the pose of the ego in a row of its poses."""
    car, vehicle, rows = world.car[0], world.vehicles[0], world.poses
    rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = vehicle.x, vehicle.y, vehicle.heading, vehicle.speed
    rows[k, 4], rows[k, 5] = vehicle.height, 1.0 if car.action == U_TURN and world.course[car.at].manoeuvre else 0.0


@compiled
def log(world: WorldArrays, code: int, kind: int, key: int, value: float) -> int:
    """Logs an event of the ego; returns its row in `events`."""
    car, vehicle = world.car[0], world.vehicles[0]
    if car.events == len(world.events):
        raise ValueError("the ego had more events in one call than its log has room for")
    event = world.events[car.events]
    car.events += 1
    event.frame, event.code, event.kind, event.key, event.value = world.clock[0].frame, code, kind, key, value
    event.x, event.y, event.own, event.body = vehicle.x, vehicle.y, False, -1
    event.lane, event.station = vehicle.plan[0], vehicle.station
    return int(car.events) - 1
