"""Sessions of one town that are played together: dialogue in Python, worlds and observations in one call for all.

Pictures of cameras are drawn on the same threads, and so are scans of lidar and radar.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.providers import sensor_spaces
from dorothie_gym.session.session_engine import SessionEngine, StepOutcome
from dorothie_gym.session.view_arrays import RoleArrays, turn_options
from dorothie_gym.session.view_steps import EVERYTHING, observe_share
from dorothie_gym.sim.batch.world_rows import WorldRows
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.support.compilation import direct
from dorothie_gym.support.compilation.records import plain
from dorothie_gym.support.copying import CachedViews, taken

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.spaces.actions import ActionMapping, RoleAction
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.tasks.storyboard import StoryboardTemplate

_observe_share = direct(observe_share)


class SessionBatch(CachedViews):
    """Sessions of one town, each of an engine of its own, whose worlds and observations are rows of arrays.

    Attributes:
        town: the map.
        numbers: number of each session, for messages.
        engines: engine of each session; an engine of a batch is not stepped by itself.
        views: observations and masks of all sessions.
        pictures: (sessions, ...) fields of the observations that the cameras and sensors of all sessions give.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_worlds",)

    def __init__(
        self, town: Town, storyboard: str | Path | StoryboardTemplate | None, *, config: EnvConfig,
        max_cycles: int | None, limits: SpaceLimits, numbers: Sequence[int], threads: int,
    ) -> None:  # fmt: skip
        """Prepares for sessions.

        Args:
            town: the map.
            storyboard: see `SessionEngine`.
            config: settings of the sessions.
            max_cycles: see `SessionEngine`.
            limits: sizes of the spaces.
            numbers: number of each session, for messages.
            threads: number of threads at most.
        """
        self.town, self.numbers = town, numbers
        self.engines = [
            SessionEngine(town, storyboard, config=config, max_cycles=max_cycles, limits=limits) for _ in numbers
        ]
        self.views = RoleArrays(limits, config.observe_acts, len(numbers))
        self.pictures: dict[str, NDArray[np.generic]] = {
            name: np.zeros((len(numbers), *(space.shape or ())), space.dtype)
            for name, space in sensor_spaces(config, Role.CO_WIZARD).items()
        }
        self._frames, self._threads = config.frames, max(1, min(threads, len(numbers)))

    @property
    def threads(self) -> int:
        """Number of threads, the caller's included."""
        return self._threads

    # --- Sessions and rows ------------------------------------------------------------------------------------------

    @cached_property
    def _worlds(self) -> WorldRows:
        """Rows of the worlds of the sessions that have begun, of which there is at least one."""
        begun = {row: engine.session.world for row, engine in enumerate(self.engines) if engine.has_begun}
        worlds = WorldRows(next(iter(begun.values())), len(self.engines), self._threads)
        for row, world in begun.items():
            worlds.put(row, world)
        return worlds

    def mutable_values(self) -> dict[str, object]:
        """Returns the changing values of the sessions."""
        return {"engines": [engine.mutable_values() for engine in self.engines], "views": self.views}

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values of `mutable_values`."""
        for engine, own in zip(self.engines, taken(values, "engines", list), strict=True):
            engine.apply_values(own)
        self.close()
        self.views = taken(values, "views", RoleArrays)

    def begin(self, row: int, seed: int | None, scenario: Scenario | None) -> None:
        """Begins a session, see `SessionEngine.reset`; `observe` must follow."""
        engine = self.engines[row]
        engine.reset(seed, scenario=scenario)
        self._worlds.put(row, engine.session.world)
        engine.session.observer.share_views(self.views, row)

    # --- A decision -------------------------------------------------------------------------------------------------

    def decode(self, actions: Mapping[int, Mapping[str, ActionMapping]]) -> dict[int, dict[Role, RoleAction]]:
        """Returns the actions of the given sessions, decoded.

        Args:
            actions: actions by row of the session and agent.

        Raises:
            ValueError: an action is missing or malformed; the message names environment, agent and field.
        """
        decoded = {}
        for row, own in actions.items():
            try:
                decoded[row] = self.engines[row].decode(own)
            except ValueError as error:
                raise ValueError(f"environment {self.numbers[row]}: {error}") from None
        return decoded

    def step(self, actions: Mapping[int, Mapping[Role, RoleAction]]) -> dict[int, StepOutcome]:
        """Steps the given sessions by one decision; `observe` must follow.

        Args:
            actions: decoded actions by row of the session.
        """
        begun = []
        for row, own in actions.items():
            begun.append(self.engines[row].begin_step(own))
            self._worlds.settle(row)
        events = self._worlds.step(list(actions), self._frames)
        return {
            row: self.engines[row].end_step(before, own)
            for row, before, own in zip(actions, begun, events, strict=True)
        }

    def observe(self, rows: Sequence[int] | None = None) -> None:
        """Writes the observations and masks of the given sessions, or of all that have begun."""
        if rows is not None:
            for row in rows:
                self.engines[row].session.observer.observe()
            self._draw(rows)
            return
        for engine in self.engines:
            if engine.has_begun:
                engine.session.observer.write()
        town = town_arrays(network_of(self.town)), turn_options(self.town)
        self._worlds.share(_observe_share, *town, self._worlds.arrays, *self.views.written, EVERYTHING)
        self._draw([row for row, engine in enumerate(self.engines) if engine.has_begun])

    def _draw(self, rows: Sequence[int]) -> None:
        """Draws the pictures of the given sessions, and reads their sensors, if they have any."""
        if not self.pictures or not rows:
            return
        self._show(rows[0])  # here: threads would compile one after another
        jobs = iter(rows[1:])  # `next` of a list's iterator is atomic

        def work(_turns: NDArray[np.int64], _home: int) -> None:
            for row in jobs:
                self._show(row)

        self._worlds.share(work)

    def _show(self, row: int) -> None:
        session = self.engines[row].session
        assert session.observer.sensors is not None  # the sessions have cameras or sensors
        for name, value in session.observer.sensors.readings(session.decisions).items():
            self.pictures[name][row] = value

    @property
    def infractions(self) -> NDArray[np.int64]:
        """Numbers of infractions so far (sessions, 5), in the order of `INFRACTION_KINDS`; callers must copy them."""
        counts: NDArray[np.int64] = plain(self._worlds.arrays.watch)[:, 0]["counts"]
        return counts

    def close(self) -> None:
        """Ends the threads; the next step begins new ones."""
        worlds = self.__dict__.pop("_worlds", None)
        if worlds is not None:
            worlds.close()
