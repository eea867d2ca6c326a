"""highway-env's observation and action settings as compiled egos understand them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from highway_env.envs.common.action import ContinuousAction, DiscreteMetaAction, action_factory
from highway_env.envs.common.observation import KinematicObservation
from highway_env.road.lane import AbstractLane
from highway_env.utils import lmap
from highway_env.vehicle.kinematics import Vehicle
from numpy.typing import NDArray

from dorothie_gym.world.kernel.kinematics import FEATURES, View
from dorothie_gym.world.kernel.meta import FASTER, IDLE, LEFT, NOTHING, RIGHT, SLOWER
from dorothie_gym.world.kernel.records import Records
from dorothie_gym.world.town.model import Array

_CODES = {"LANE_LEFT": LEFT, "IDLE": IDLE, "LANE_RIGHT": RIGHT, "FASTER": FASTER, "SLOWER": SLOWER}


class Actions:
    """What egos are told.

    Attributes:
        space: of the actions of one.
        speeds: that an ego of meta actions may hold [m/s]; empty for continuous actions.
    """

    def __init__(self, config: Mapping[str, Any]) -> None:
        """Read highway-env's setting `action`; raises `ValueError` for what only plain environments can do."""
        if config.get("type") not in ("DiscreteMetaAction", "ContinuousAction"):
            raise _sync_only("action", f"type {config.get('type')!r}")
        self._stock = action_factory(None, dict(config))
        self.space: spaces.Space[Any] = self._stock.space()
        self.speeds: Array = np.zeros(0)
        self._codes: NDArray[np.int32] = np.zeros(0, dtype=np.int32)
        self._discrete = isinstance(self._stock, DiscreteMetaAction)
        if self._discrete:
            self._read_speeds()
        else:
            self._read_ranges()

    def _read_speeds(self) -> None:
        self.speeds = np.array(self._stock.target_speeds, dtype=np.float64)
        if self.speeds.ndim != 1 or len(self.speeds) < 2 or self.speeds[0] == self.speeds[-1]:
            raise ValueError(f"action: target_speeds must be two or more speeds, not {self._stock.target_speeds}")
        self._codes = np.array([_CODES[self._stock.actions[k]] for k in range(len(self._stock.actions))], np.int32)

    def _read_ranges(self) -> None:
        stock: ContinuousAction = self._stock
        if stock.dynamical:
            raise _sync_only("action", "dynamical")
        if stock.speed_range and max(map(abs, stock.speed_range)) > Vehicle.MAX_SPEED:
            raise _sync_only("action", f"a speed_range beyond {Vehicle.MAX_SPEED} m/s")

    def read(self, actions: NDArray[Any], space: spaces.Space[Any], helms: Records) -> NDArray[np.int32]:
        """Codes (n,) of meta actions; continuous actions are written to the helms, and are no meta actions.

        Args:
            actions: (n, ...) one for each ego.
            space: of the actions of all.
            helms: `meta.HELM` of each ego.

        Raises:
            ValueError: actions of the wrong shape, or that do not exist.
        """
        if actions.shape != space.shape:
            raise ValueError(f"actions must have the shape {space.shape}, not {actions.shape}")
        if self._discrete:
            if not np.issubdtype(actions.dtype, np.integer) or actions.min() < 0 or actions.max() >= len(self._codes):
                raise ValueError(f"actions must be integers from 0 to {len(self._codes) - 1}, not {actions}")
            codes: NDArray[np.int32] = self._codes[actions]
            return codes
        stock: ContinuousAction = self._stock
        wanted = np.clip(actions, -1, 1) if stock.clip else actions
        helms.acceleration = lmap(wanted[:, 0], [-1, 1], stock.acceleration_range) if stock.longitudinal else 0.0
        helms.steering = lmap(wanted[:, -1], [-1, 1], stock.steering_range) if stock.lateral else 0.0
        return np.full(len(actions), NOTHING, dtype=np.int32)

    def limit(self, helm: Records) -> None:
        """Tells an ego of the range of its speeds."""
        if not self._discrete and self._stock.speed_range:
            helm.lowest, helm.highest = self._stock.speed_range


class Kinematics:
    """What egos observe.

    Attributes:
        space: of the observations of one.
        view: what its columns are, and how they are filled.
        shuffled: whether the rows of others are in random order.
    """

    def __init__(self, config: Mapping[str, Any]) -> None:
        """Read highway-env's setting `observation`; raises `ValueError` for what only plain environments can do."""
        if config.get("type") != "Kinematics":
            raise _sync_only("observation", f"type {config.get('type')!r}")
        self._stock = KinematicObservation(None, **config)
        unknown = [feature for feature in self._stock.features if feature not in FEATURES]
        if unknown:
            raise _sync_only("observation", f"features {', '.join(unknown)}")
        if self._stock.vehicles_count < 1:
            raise ValueError(f"observation: vehicles_count must be at least 1, not {self._stock.vehicles_count}")
        if self._stock.order not in ("sorted", "shuffled"):
            raise ValueError(f"observation: order must be 'sorted' or 'shuffled', not {self._stock.order!r}")
        self.space: spaces.Box = self._stock.space()
        self.shuffled = self._stock.order == "shuffled"
        codes = np.array([FEATURES[feature] for feature in self._stock.features], dtype=np.int32)
        self.view = View(
            codes,
            absolute=bool(self._stock.absolute),
            ordered=not self.shuffled,
            behind=bool(self._stock.see_behind),
            clip=bool(self._stock.clip),
            walkers=bool(self._stock.include_obstacles),
        )

    def ranges(self, lanes: int) -> Array:
        """(f, 2) values of each feature that are shown as -1 and 1, NaN where values are shown as they are.

        Args:
            lanes: how many there are on the road where the ego begins: highway-env's unit of `y`.
        """
        found = np.full((len(self._stock.features), 2), np.nan)
        if self._stock.normalize:
            far, fast, wide = 5.0 * Vehicle.MAX_SPEED, 2.0 * Vehicle.MAX_SPEED, AbstractLane.DEFAULT_WIDTH * lanes
            usual = {"x": (-far, far), "y": (-wide, wide), "vx": (-fast, fast), "vy": (-fast, fast)}
            for name, limits in (self._stock.features_range or usual).items():
                found[[feature == name for feature in self._stock.features]] = limits
        return found


def _sync_only(setting: str, what: str) -> ValueError:
    return ValueError(
        f"{setting}: {what} is not compiled for many environments at once; "
        'gymnasium.make_vec(..., vectorization_mode="sync") runs the plain environments with it'
    )
