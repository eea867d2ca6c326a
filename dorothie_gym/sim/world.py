"""World of a session: a town with the ego, traffic, pedestrians and props, weather and sensor faults.

A session steps its world between two decisions (`World.step`). Everything that moves is a row of the arrays in
`World.actors`, which the compiled loop in `sim/step.py` steps at 30 Hz; `World.ego` takes the Co-Wizard's actions.

Fourth of the five files that explain the package. Next: `policies/policy.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.ontology.world_exceptions import Sensor, WeatherParameter
from dorothie_gym.sim.actors import Actors
from dorothie_gym.sim.batch.threads import turns_of
from dorothie_gym.sim.batch.worlds import alone
from dorothie_gym.sim.config import FAULT_SECONDS, FRAME_COLUMNS, FRAME_RATE, WorldConfig
from dorothie_gym.sim.ego.decision_setup import note_props
from dorothie_gym.sim.ego.ego_controller import Car, CarRecord, EgoController, LocalPlanner
from dorothie_gym.sim.ego.obstacles import Hazard, PerceivedBody
from dorothie_gym.sim.network.network import TownNetwork, network_of
from dorothie_gym.sim.road import TownRoad
from dorothie_gym.sim.sensing.localizer import Localizer
from dorothie_gym.sim.sensing.perception import BODY, Perception, look_around
from dorothie_gym.sim.sensing.visibility import CLARITY
from dorothie_gym.sim.state.codes import NO_SPACE
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, lengthened
from dorothie_gym.sim.step import step_share
from dorothie_gym.sim.traffic.parameters import MAX_SUBSTEPS
from dorothie_gym.sim.traffic_rules import WorldEvent, WorldEventLog
from dorothie_gym.sim.weather import Weather, Wind
from dorothie_gym.sim.world_start import OwnArrays, WorldSeeds, start_world
from dorothie_gym.support.compilation import fixed
from dorothie_gym.support.compilation.records import plain
from dorothie_gym.support.copying import CachedViews, Restorable

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import Town
    from dorothie_gym.sim.sensing.visibility import Visibility

_step_share = fixed(step_share)


def parts_of(frames: int) -> list[int]:
    """Divides the frames of a step into parts of at most `MAX_SUBSTEPS`, for which the log of the ego has room."""
    return [min(MAX_SUBSTEPS, frames - first) for first in range(0, max(frames, 1), MAX_SUBSTEPS)]


class World(CachedViews, Restorable):
    """A town in which the ego drives among others.

    All that moves is stepped by compiled loops (`sim.step`); this class writes their input and reads their results.

    Attributes:
        town: the map.
        network: its lanes as a graph of highway-env.
        road: highway-env's road, with the ego and all others on it.
        car: the ego as a vehicle of highway-env.
        planner: its local planner.
        ego: controller of the ego, which takes physical actions.
        actors: traffic, pedestrians and props.
        weather: weather and light.
        wind: direction of the wind, and its gusts.
        faults: sensors that are faulty, and the frame at which each works again.
        hazard: cause of a hazard stop, or None.
        frame: physics frames since the start.
        frames: trajectory of the last call of `step` (n, 9), see `FRAME_COLUMNS`.
        offsets: offset of the ego to the right of its path at each of these frames (n,) [m].
        reports: events of the ego, and the numbers of its infractions.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_record_of", "_own_record", "_batch_of", "_batch", "_scratch")

    _record_of: WorldArrays | None = None
    _batch_of: WorldArrays | None = None

    def __init__(
        self,
        town: Town,
        config: WorldConfig,
        *,
        seed: np.random.SeedSequence,
        departure: tuple[int, float],
        network: TownNetwork | None = None,
        arrays: WorldArrays | None = None,
    ) -> None:
        """Builds the world.

        Args:
            town: the map.
            config: settings.
            seed: source of the seeds of traffic, pedestrians, localisation, perception and wind, one each.
            departure: lane and distance along it [m] of the ego.
            network: the town's network, if it was built already; it is never changed.
            arrays: arrays of the world, if it was started already (`start_world`) with the same arguments.
        """
        seeds = WorldSeeds(*seed.spawn(5))
        self.town, self.config = town, config
        self.network = network or network_of(town)
        self._arrays = town_arrays(self.network)
        if arrays is None:
            own = OwnArrays(self.network, config)
            start_world(self.network, own, config, seeds, departure)
            arrays = own.arrays
        self.road = TownRoad(self.network, np_random=np.random.default_rng(seeds.crowd))
        self.actors = Actors(self.road, self._arrays, arrays, seeds.places()[0])
        self.car = Car(self.road, self.actors)
        self.road.vehicles.append(self.car)
        self.planner = LocalPlanner(town, self._arrays, self.actors)
        self.ego = EgoController(self.planner, self.car, self.actors)
        self.weather = Weather()
        self.wind = Wind(np.random.default_rng(seeds.wind))
        self._perception = Perception(np.random.default_rng(seeds.perception))
        self.localizer = Localizer(self.actors)
        self.faults: dict[Sensor, int] = {}
        self.frame = int(plain(arrays.clock)["frame"][0])
        self.frames: Array = np.zeros((0, len(FRAME_COLUMNS)))
        self.offsets: Array = np.zeros(0)
        self.reports = WorldEventLog(self.network, self.actors)

    # --- Copies -------------------------------------------------------------------------------------------------------

    def mutable_values(self) -> dict[str, object]:
        """Returns all attributes but the views, which are looked up again."""
        return self.__getstate__()

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies these attributes."""
        self.__dict__ = values

    def compatibility(self) -> dict[str, object]:
        """Returns the town and the settings."""
        return {**super().compatibility(), "the town": self.town.identity, "the settings": self.config}

    @cached_property
    def _scratch(self) -> tuple[NDArray[np.int64], Array, NDArray[np.int64]]:
        """Turns, inputs and answers of a step as a batch of one, see `step_share`."""
        return turns_of(1, 1), np.zeros(1), np.zeros(1, dtype=np.int64)

    # --- Time ---------------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated seconds since the start."""
        return self.frame / FRAME_RATE

    def step(self, frames: int) -> list[WorldEvent]:
        """Runs the world for a number of physics frames; returns the events of the ego."""
        traces = []
        for part in parts_of(frames) if frames > MAX_SUBSTEPS else (frames,):
            self.begin_part()
            self._run(part)
            traces.append(self.end_part(part))
        return self.end_step(traces)

    def _run(self, frames: int) -> None:
        """Steps all bodies as a batch of one by no more than `MAX_SUBSTEPS` substeps."""
        turns, inputs, answers = self._scratch
        answers[0] = NO_SPACE
        while True:
            turns[0, 0] = 0
            _step_share(turns, 0, self._arrays, self.batch, frames, 1.0 / FRAME_RATE, inputs, inputs, answers)
            if answers[0] != NO_SPACE:
                return
            self.actors.arrays = lengthened(self.actors.arrays)

    @property
    def batch(self) -> WorldArrays:
        """Arrays of the world as a batch of one."""
        if self._batch_of is not self.actors.arrays:
            self._batch_of, self._batch = self.actors.arrays, alone(self.actors.arrays)
        return self._batch

    def begin_part(self) -> None:
        """Writes the inputs of the physics before a part of a step, see `parts_of`."""
        self.write_weather()

    def end_part(self, frames: int) -> Array:
        """Reads the results of a part of a step; returns the ego's trace, see `WorldArrays`."""
        self.car.refresh()
        self.frame += frames
        events, breaches, _ = self._record.outcome.item()
        if events or breaches:
            self.reports.note(events, breaches)
        return self.actors.arrays.trace[:frames].copy()

    def end_step(self, traces: Sequence[Array]) -> list[WorldEvent]:
        """Ends a step with the traces of its parts; returns the events of the ego."""
        trace = traces[0] if len(traces) == 1 else np.concatenate(traces)
        self.frames, self.offsets = trace[:, : len(FRAME_COLUMNS)], trace[:, -1]
        if self.faults:
            self.faults = {sensor: end for sensor, end in self.faults.items() if end > self.frame}
            self.write_weather()
        self._note_props()
        return self.reports.take()

    def catch_up(self) -> None:
        """Reads time and place of the ego after another caller has stepped the arrays of the world."""
        self.frame = int(plain(self.actors.arrays.clock)["frame"][0])
        self.car.refresh()
        if self.faults:
            self.faults = {sensor: end for sensor, end in self.faults.items() if end > self.frame}

    @property
    def _record(self) -> CarRecord:
        """Fields of the ego's record."""
        if self._record_of is not self.actors.arrays:
            self._record_of, self._own_record = self.actors.arrays, CarRecord(self.actors.arrays)
        return self._own_record

    def write_weather(self) -> None:
        """Writes the effects of the weather on grip, sight and course into the world's arrays after a change."""
        visibility = self.visibility  # a new object after any change of the weather
        if self._perception.open(self.actors.arrays.eye, visibility):
            wind = self.weather.above_clear(WeatherParameter.WIND_INTENSITY)
            self._record.air[()] = self.weather.friction, wind, self.wind.heading, tuple(self.wind.phases)

    @property
    def hazard(self) -> Hazard | None:
        """Cause of a hazard stop, or None."""
        kind, gap = self._record.hazard.item()
        return Hazard(kind=ObjectClass(kind), gap=gap) if kind else None

    @property
    def collisions(self) -> int:
        """Number of collisions by the ego's own fault."""
        return int(self._record.outcome.item()[2])

    # --- Perception ---------------------------------------------------------------------------------------------------

    @property
    def visibility(self) -> Visibility:
        """Current visibility, by weather, light and faults of the view."""
        clarity = 1.0
        if self.faults:
            clarity = min((CLARITY[sensor] for sensor in CLARITY if self._is_faulty(sensor, self.frame)), default=1.0)
        return self.weather.visibility(lights=bool(self._record.lights.item()[0]), clarity=clarity)

    @property
    def sight(self) -> float:
        """Distance up to which all bodies are perceived now [m]."""
        return self.visibility.sight

    def perceived(self) -> list[PerceivedBody]:
        """Returns the perceived bodies at their perceived places, nearest first."""
        return [
            PerceivedBody(
                key=int(key), kind=ObjectClass(int(kind)), x=x, y=y, heading=heading, length=length, width=width,
                speed=speed, height=height,
            )
            for key, kind, x, y, heading, length, width, speed, height in self.seen().tolist()
        ]  # fmt: skip

    @property
    def sensing_arrays(self) -> WorldArrays:
        """Arrays of the world, with the current visibility."""
        self.write_weather()
        return self.actors.arrays

    def seen(self) -> Array:
        """Returns the perceived bodies as numbers (n, 9), columns `perception.BODY` [m, rad, m/s]."""
        arrays = self.sensing_arrays
        table = np.empty((len(arrays.seen), len(BODY)))
        return table[: look_around(arrays, self.frame, table)]

    def _note_props(self) -> None:
        """Records the perceived props for the planner."""
        arrays = self.actors.arrays
        if self.actors.has_props:
            self.write_weather()
            note_props(arrays, self.frame)
        else:
            self._record.props[()] = 0

    # --- Faults -------------------------------------------------------------------------------------------------------

    def _is_faulty(self, sensor: Sensor, frame: int) -> bool:
        return self.faults.get(sensor, frame) > frame

    def set_fault(self, sensor: Sensor, on: bool) -> str | None:
        """Switches a sensor fault on or off; returns the reason of a refusal."""
        if on == (sensor in self.faults):
            return f"the fault of {sensor} is {'on' if on else 'off'} already"
        if on:
            self.faults[sensor] = self.frame + round(FAULT_SECONDS * FRAME_RATE)
        else:
            del self.faults[sensor]
        self.localizer.lose_gps(self.faults.get(Sensor.GPS, 0))
        return None
