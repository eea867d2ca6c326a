"""Base class of the vectorised navigation environments, the results of `gymnasium.make_vec`."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Final

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from dorothie_gym.envs.batched_env import BatchedEnv, Towns
from dorothie_gym.envs.navigation.batch import DrivingBatch
from dorothie_gym.envs.navigation.batch_arrays import INFRACTIONS, REFUSED
from dorothie_gym.envs.navigation.cameras import DriverObservation
from dorothie_gym.envs.navigation.config import NavigationConfig
from dorothie_gym.envs.navigation.episode import Ending
from dorothie_gym.envs.navigation.render import DrivingView
from dorothie_gym.envs.session_view import SessionView
from dorothie_gym.errors import short_repr
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.config import checked_view
from dorothie_gym.session.rewards import NAVIGATION_TERMS
from dorothie_gym.session.scenario import Scenario, check_options, scenario_option, template_option
from dorothie_gym.support.vector_infos import Infos, mask_of, masked_infos, seeds_of

if TYPE_CHECKING:
    from dorothie_gym.tasks.storyboard import StoryboardTemplate

LARGEST_SEED: Final = 2**31
"""Seeds of sessions that follow without a seed of their own are below."""


class DrivingVectorEnv(
    BatchedEnv[NavigationConfig, DrivingBatch], VectorEnv[DriverObservation, NDArray[np.generic], NDArray[np.generic]]
):
    """Base class of the vectorised navigation environments.

    Each environment has episodes of its own: they depend on its seed and actions, and neither on the other
    environments, nor on its index, nor on the number of threads.
    """

    MUTABLE_ATTRIBUTES: ClassVar[Sequence[str]] = (
        "_observations", "_rewards", "_terminations", "_truncations", "_terms", "_infractions", "_refused",
        "_refusal_reasons", "_subgoals", "_success", "_reasons", "_begun", "_generators", "_seeds",
    )  # fmt: skip

    def __init__(
        self, num_envs: int, town: Towns, storyboard: str | Path | StoryboardTemplate | None,
        config: NavigationConfig, observation_space: spaces.Space[DriverObservation],
        action_space: spaces.Space[np.int64] | spaces.Space[NDArray[np.float32]], render_mode: str | None, view: str,
        render_view: str, threads: int | None, autoreset_mode: str | AutoresetMode, *, pedals: bool,
    ) -> None:  # fmt: skip
        super().__init__(num_envs, town, config, render_mode, threads, autoreset_mode)
        import_module("filterpy.kalman")  # takes a second, for which no decision should wait: see `beliefs.refined`
        self.metadata = {**self.metadata, "render_fps": config.decision_frequency}
        self.single_observation_space, self.single_action_space = observation_space, action_space
        self.observation_space = batch_space(observation_space, num_envs)
        self.action_space = batch_space(action_space, num_envs)
        assert self.observation_space.shape is not None
        self._observations: DriverObservation = np.zeros(
            self.observation_space.shape, dtype=self.observation_space.dtype
        )
        self._rewards = np.zeros(num_envs)
        self._terminations, self._truncations = (np.zeros(num_envs, dtype=np.bool_) for _ in range(2))
        self._terms = np.zeros((num_envs, len(NAVIGATION_TERMS)))
        self._infractions = np.zeros((num_envs, len(INFRACTIONS)), dtype=np.int64)
        self._subgoals = np.zeros((num_envs, 2), dtype=np.int64)
        self._success = np.zeros(num_envs, dtype=np.bool_)
        self._refused = np.zeros((num_envs, len(REFUSED)), dtype=np.bool_)
        self._refusal_reasons = np.full(num_envs, "", dtype=object)
        self._reasons = np.full(num_envs, "", dtype=object)
        self._begun = np.zeros(num_envs, dtype=np.bool_)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._seeds: list[int] = [-1] * num_envs
        template = template_option(storyboard)
        self._make_batches(
            lambda each, numbers, threads: DrivingBatch(each, template, config, len(numbers), threads, pedals=pedals)
        )
        shown = checked_view(render_view)
        self._views = [
            DrivingView(SessionView.of_role(Role.CO_WIZARD, view, render_mode, config.decision_frequency, shown))
            for _ in range(num_envs if render_mode is not None else 0)
        ]

    @property
    def nbytes(self) -> int:
        """Memory of the environments' arrays [bytes]."""
        return sum(batch.nbytes for batch in self.batches)

    # --- Gymnasium's interface ----------------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, object] | None = None
    ) -> tuple[DriverObservation, Infos]:
        """Begins new episodes.

        Args:
            seed: seed of the first environment; the others have the numbers that follow. A sequence has one for each.
            options: `reset_mask`, a bool array (num_envs,): which environments, by default all; `scenario` as in the
                single environment, for all of them.

        Returns:
            Observations (num_envs, ...) of all environments, and infos of those that begin.

        Raises:
            ValueError: not one seed for each environment, or a mask of the wrong shape or type.
        """
        options = dict(options or {})
        mask = mask_of(options.pop("reset_mask", None), self.num_envs)
        check_options(options, "scenario")
        seeds = seeds_of(seed, self.num_envs)
        self._begin({i: seeds[i] for i in np.flatnonzero(mask).tolist()}, scenario_option(options))
        return self._observations.copy(), self._infos(mask)

    def step(
        self, actions: NDArray[np.generic]
    ) -> tuple[DriverObservation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Infos]:
        """Steps every environment by one decision; finished ones are reset according to the autoreset mode.

        Args:
            actions: (num_envs, ...) one for each.

        Returns:
            Observations (num_envs, ...), rewards, terminations and truncations (num_envs,), infos.

        Raises:
            ValueError: the actions are not in the action space.
            gymnasium.error.ResetNeeded: an environment was never reset, or has ended and is not reset automatically.
        """
        actions = self._checked(actions)
        over = self._terminations | self._truncations
        mode = self.autoreset_mode
        if not self._begun.all() or (mode is AutoresetMode.DISABLED and over.any()):
            waiting = np.flatnonzero(~self._begun | over)
            raise gym.error.ResetNeeded(f"environments {short_repr(waiting.tolist())} wait for a reset: call reset()")
        self._play(actions, ~over)
        if over.any():
            self._begin(dict.fromkeys(np.flatnonzero(over).tolist()), None)
        rewards, terminations, truncations = self._rewards.copy(), self._terminations.copy(), self._truncations.copy()
        over = terminations | truncations
        if mode is AutoresetMode.SAME_STEP and over.any():
            infos = self._begin_at_once(over)
        else:
            infos = self._infos(np.ones(self.num_envs, dtype=np.bool_))
        return self._observations.copy(), rewards, terminations, truncations, infos

    def render_one(self, number: int) -> NDArray[np.uint8] | None:
        """Draws one of the environments, as the single environment does."""
        batch, place = self._places[range(self.num_envs)[number]]
        view = self._views[number].view if self._views else SessionView(None, frames_per_second=1.0)
        return view.render(batch.catch_up(place))

    def close_extras(self, **_kwargs: object) -> None:
        """Ends the threads."""
        for batch in self.batches:
            batch.close()

    # of many environments instead of one, and read-only
    @property  # type: ignore[misc]  # gymnasium's is writable
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]  # see above
        """The environments' generators."""
        return tuple(self._generator(number) for number in range(self.num_envs))

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]  # see `np_random`
        """The environments' seeds."""
        return tuple(self._seeds[number] for number, _ in enumerate(self.np_random))

    # --- Episodes -----------------------------------------------------------------------------------------------------

    @abstractmethod
    def _checked(self, actions: object) -> NDArray[np.generic]:
        """Returns actions as an array; raises `ValueError` if they are not in the action space."""

    def _play(self, actions: NDArray[np.generic], playing: NDArray[np.bool_]) -> None:
        """Steps the environments of a mask by one decision, and records the outcome."""
        for batch, members in zip(self.batches, self._members, strict=True):
            if playing[members].any():
                batch.play(actions[members], playing[members])
                self._note(batch, members)  # the others are reset in the same step
                for number in members[playing[members]].tolist() if self._views else ():
                    self._views[number].note(*self._places[number])

    def _start(self, seeds: Mapping[int, int], scenario: Scenario | None) -> None:
        """Begins sessions of environments by their seeds, and records observations and outcomes."""
        for batch, members in zip(self.batches, self._members, strict=True):
            own = {place: seeds[number] for place, number in enumerate(members.tolist()) if number in seeds}
            if own:
                batch.begin(own, scenario)
                self._note(batch, members, list(own))
                for number in members[list(own)].tolist() if self._views else ():
                    self._views[number].note(*self._places[number])

    def _note(self, batch: DrivingBatch, members: NDArray[np.int64], rows: slice | list[int] = slice(None)) -> None:
        """Copies the outcomes of the given rows of a batch, by default of all."""
        outcomes, changed = batch.outcomes[rows], members[rows]
        numbers = slice(None) if len(changed) == self.num_envs else changed
        self._observations[numbers] = batch.observations[rows]
        self._rewards[numbers], self._terms[numbers] = outcomes["reward"], outcomes["terms"]
        self._infractions[numbers] = batch.infractions[rows]
        endings = outcomes["ending"]
        over, truncated = endings > 0, endings == Ending.OUT_OF_TIME
        self._truncations[numbers], self._terminations[numbers] = truncated, over & ~truncated
        self._refused[numbers], self._refusal_reasons[numbers] = False, ""
        for row in np.flatnonzero(batch.any_refused[rows]).tolist():
            reasons = list(batch.refusals(row if isinstance(rows, slice) else rows[row]).values())
            self._refused[changed[row]] = [bool(reason) for reason in reasons]
            self._refusal_reasons[changed[row]] = "; ".join(filter(None, reasons))
        if over.any():
            self._success[numbers] = batch.successes[rows]
            self._subgoals[numbers, 0] = batch.live_subgoals[rows]
            self._subgoals[numbers, 1] = outcomes["reached"]
            self._reasons[numbers] = ""
            for row in np.flatnonzero(over).tolist():
                self._reasons[changed[row]] = Ending(endings[row]).label

    def _begin(self, seeds: Mapping[int, int | None], scenario: Scenario | None) -> None:
        """Begins episodes of environments; a seed of None continues the environment's own series."""
        for number, seed in seeds.items():
            if seed is not None:
                self._generators[number], self._seeds[number] = seeding.np_random(seed)
        self._start(
            {
                number: int(self._generator(number).integers(LARGEST_SEED)) if seed is None else seed
                for number, seed in seeds.items()
            },
            scenario,
        )
        begun = list(seeds)
        self._rewards[begun], self._terminations[begun], self._truncations[begun] = 0.0, False, False
        self._begun[begun] = True

    def _generator(self, number: int) -> np.random.Generator:
        found = self._generators[number]
        if found is None:
            found, self._seeds[number] = seeding.np_random()
            self._generators[number] = found
        return found

    def _begin_at_once(self, over: NDArray[np.bool_]) -> Infos:
        """Resets environments whose episode has ended; returns the infos of the mode `SAME_STEP`."""
        final = np.full(self.num_envs, None, dtype=object)
        ended, numbers = self._infos(over), np.flatnonzero(over).tolist()
        for number in numbers:
            final[number] = self._observations[number].copy()
        self._begin(dict.fromkeys(numbers), None)
        infos = self._infos(np.ones(self.num_envs, dtype=np.bool_))
        return {**infos, "final_obs": final, "_final_obs": over, "final_info": ended, "_final_info": over.copy()}

    def _infos(self, mask: NDArray[np.bool_]) -> Infos:
        """Returns the infos of the environments of a mask; entries about the end are "" or 0 until then."""
        terms = {name: self._terms[:, k] for k, name in enumerate(NAVIGATION_TERMS)}
        infractions = {name: self._infractions[:, k] for k, name in enumerate(INFRACTIONS)}
        over = self._terminations | self._truncations
        subgoals = {"live": self._subgoals[:, 0] * over, "reached": self._subgoals[:, 1] * over}
        return masked_infos(
            {
                "reward_terms": masked_infos(terms, mask),
                "refused": masked_infos({kind: self._refused[:, k] for k, kind in enumerate(REFUSED)}, mask),
                "refusal_reason": self._refusal_reasons,
                "infractions": masked_infos(infractions, mask),
                "is_success": self._success & over,
                "reason": np.where(over, self._reasons, ""),
                "subgoals": masked_infos(subgoals, mask),
            },
            mask,
        )
