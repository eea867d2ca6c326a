"""Common base of the vectorised environments: a batch of environments for each town, whose worlds threads step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Generic, TypeAlias, TypeVar

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.batch import DrivingBatch
from dorothie_gym.envs.navigation.config import NavigationConfig
from dorothie_gym.maps.catalogue import load_town
from dorothie_gym.maps.generated.specification import parse_series
from dorothie_gym.maps.town import Town
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_batch import SessionBatch
from dorothie_gym.support.copying import Restorable, taken
from dorothie_gym.support.processors import available_processors

Towns: TypeAlias = "str | Path | Town | Sequence[str | Path | Town]"
"""A town, or several over which the environments of a batch cycle; "generated" stands for the first of a series."""

POOL = 64
"""Largest number of towns of a series in a batch: each is a batch of its own."""


C = TypeVar("C", bound=EnvConfig | NavigationConfig)
B = TypeVar("B", bound=SessionBatch | DrivingBatch)


class BatchedEnv(Restorable, Generic[C, B]):
    """Common base of the vectorised environments.

    Attributes:
        num_envs: number of environments.
        autoreset_mode: when finished environments are reset, as in `gymnasium.vector.SyncVectorEnv`.
        towns: town of each environment.
        config: settings.
        batches: a batch for each town.
    """

    metadata: dict[str, object] = {"render_modes": ["rgb_array"], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int,
        town: Towns,
        config: C,
        render_mode: str | None,
        threads: int | None,
        autoreset_mode: str | AutoresetMode,
    ) -> None:
        """Checks the arguments and loads the towns; the batches are made by `_make_batches`.

        Raises:
            ValueError: an argument is out of its range.
        """
        if num_envs < 1:
            raise ValueError(f"num_envs is {num_envs}; it must be at least 1")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode is {render_mode!r}; it must be None or 'rgb_array' for several environments")
        if threads is not None and threads < 1:
            raise ValueError(f"threads is {threads}; it must be at least 1, or None for one per processor")
        names = [town] if isinstance(town, str | Path | Town) else list(town)
        if not names:
            raise ValueError("town is an empty sequence; it must name at least one town")
        series = [(name, parse_series(name)) for name in names]
        names = [each for name, own in series for each in (own.pool(min(POOL, num_envs)) if own else (name,))]
        loaded = [each if isinstance(each, Town) else load_town(each) for each in names]
        self.towns = [loaded[number % len(loaded)] for number in range(num_envs)]
        self.num_envs, self.render_mode, self.config = num_envs, render_mode, config
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self._most_threads = threads or available_processors()

    def _make_batches(self, make: Callable[[Town, list[int], int], B]) -> None:
        """Makes the batches by a function of the town, the numbers of its environments and the number of threads."""
        towns: dict[Town, list[int]] = {}
        for number, town in enumerate(self.towns):
            towns.setdefault(town, []).append(number)
        self.batches = [make(town, numbers, self._most_threads) for town, numbers in towns.items()]
        self._members = [np.array(numbers) for numbers in towns.values()]
        self._places = {
            number: (batch, place)
            for batch, members in zip(self.batches, self._members, strict=True)
            for place, number in enumerate(members.tolist())
        }

    @property
    def threads(self) -> int:
        """Number of threads that step the environments."""
        return max(batch.threads for batch in self.batches)

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Draws the first environment; `render_one` draws another one."""
        frame = self.render_one(0)
        return None if frame is None else (frame,)

    def render_one(self, number: int) -> NDArray[np.uint8] | None:
        """Draws one of the environments (800, 1280, 3), as the single environment does; None without a render mode."""
        raise NotImplementedError

    # --- States -------------------------------------------------------------------------------------------------------

    def mutable_values(self) -> dict[str, object]:
        """Returns the changing values of the environments."""
        return {**super().mutable_values(), "batches": [batch.mutable_values() for batch in self.batches]}

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values of the environments; pictures are started again."""
        for batch, part in zip(self.batches, taken(values, "batches", list), strict=True):
            batch.apply_values(part)
        super().apply_values(values)

    def compatibility(self) -> dict[str, object]:
        """Returns the kind of environment, the towns and the settings."""
        towns = [town.identity for town in self.towns]
        return {
            **super().compatibility(),
            "the number of environments": len(towns),
            "the towns": towns,
            "the settings": self.config,
        }
