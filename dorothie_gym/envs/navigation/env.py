"""Base class of the navigation environments of one car: a batch of one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.batch import DrivingBatch
from dorothie_gym.envs.navigation.batch_arrays import INFRACTIONS
from dorothie_gym.envs.navigation.cameras import DriverObservation
from dorothie_gym.envs.navigation.episode import Ending
from dorothie_gym.envs.navigation.render import DrivingView
from dorothie_gym.envs.session_view import SessionView, metadata_at
from dorothie_gym.maps.catalogue import town_at
from dorothie_gym.maps.generated.specification import parse_series
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.navigation.instructor import words_of
from dorothie_gym.session.rewards import NAVIGATION_TERMS
from dorothie_gym.session.scenario import ResetOptions, check_options, scenario_option, template_option
from dorothie_gym.support.copying import Restorable, taken
from dorothie_gym.support.time_limit import TimeLimitedEnv, decisions_in

if TYPE_CHECKING:
    from dorothie_gym.envs.navigation.config import NavigationConfig
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.live_session import LiveSession
    from dorothie_gym.session.spaces.actions import StepInfo
    from dorothie_gym.tasks.storyboard import StoryboardTemplate

Action = TypeVar("Action")


class DrivingEnv(Restorable, TimeLimitedEnv[DriverObservation, Action]):
    """Base class of the navigation environments; subclasses define observations and actions.

    Attributes:
        config: settings.
        town: the map.
        template: template of the storyboards, or None.
        batch: the session, as a batch of one.
    """

    MUTABLE_ATTRIBUTES: ClassVar[Sequence[str]] = ("_ending", "_np_random", "_np_random_seed", "_town_seed")

    def __init__(
        self, town: str | Path | Town, storyboard: str | Path | StoryboardTemplate | None, config: NavigationConfig,
        render_mode: str | None, view: str, render_view: str, *, pedals: bool,
    ) -> None:  # fmt: skip
        self.config = config
        self.metadata = metadata_at(config.decision_frequency)
        self.render_mode = render_mode
        drawn = SessionView.of_role(Role.CO_WIZARD, view, render_mode, config.decision_frequency, render_view)
        self._view = DrivingView(drawn)
        self.template = template_option(storyboard)
        self._series, self._town_seed, self._pedals = parse_series(town), 0, pedals
        self.town = town_at(self._series or town, 0)
        self.batch = self._new_batch()
        self._ending = Ending.NONE

    def _new_batch(self) -> DrivingBatch:
        return DrivingBatch(self.town, self.template, self.config, 1, 1, pedals=self._pedals)

    def _enter(self, seed: int) -> None:
        """Begins a batch in the town of a seed, if each seed has a town of its own."""
        self._town_seed = seed
        if self._series is not None and self._series.name(seed) != self.town.name:
            self.town = town_at(self._series, seed)
            self.batch = self._new_batch()

    # --- States -------------------------------------------------------------------------------------------------------

    def mutable_values(self) -> dict[str, object]:
        """Returns the changing values of the environment, and the notes for its pictures."""
        return {**super().mutable_values(), "batch": self.batch.mutable_values(), "view": self._view.notes}

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values of the environment and the notes for its pictures."""
        notes, batch = taken(values, "view", tuple), taken(values, "batch", dict)
        super().apply_values(values)
        self._enter(self._town_seed)
        self.batch.apply_values(batch)
        if self.batch.has_begun:
            self._view.apply_values(notes, self.batch.catch_up(0))

    def compatibility(self) -> dict[str, object]:
        """Returns the kind of environment, the town and the settings."""
        return {**super().compatibility(), "the town": self._series or self.town.identity, "the settings": self.config}

    # --- Episodes -----------------------------------------------------------------------------------------------------

    @property
    def decision_limit(self) -> int:
        """Decisions until truncation."""
        return decisions_in(self.config.max_seconds, self.config.decision_frequency)

    @property
    def instruction(self) -> str:
        """Words of the instruction that is in force; empty before the first one."""
        self._check_begun()
        said = self.batch.heard(0).instruction
        return "" if said is None else words_of(said)

    @property
    def session(self) -> LiveSession:
        """Session in progress; raises `gymnasium.error.ResetNeeded` before the first reset."""
        self._check_begun()
        session = self.batch.catch_up(0)
        if self._ending and not session.over:
            session.end(self._ending.label)
        return session

    def _check_begun(self) -> None:
        if not self.batch.has_begun:
            raise gym.error.ResetNeeded("no session is being played: call reset() first")

    def _begin(self, seed: int | None, options: ResetOptions | None) -> tuple[DriverObservation, StepInfo]:
        """Begins a session, see `reset`."""
        super().reset(seed=seed)
        check_options(options, "scenario")
        session = seed if seed is not None else int(self.np_random.integers(2**31))
        scenario = scenario_option(options)
        self._enter(session if scenario is None else scenario.seed)
        self.batch.begin({0: session}, scenario)
        self._ending = Ending.NONE
        self._show()
        return self.batch.observations[0].copy(), self._info()

    def _play(self, action: NDArray[np.generic] | int) -> tuple[DriverObservation, float, bool, bool, StepInfo]:
        """Steps the environment by one decision, see `step`."""
        if self._ending:
            raise gym.error.ResetNeeded("the session is over: call reset() first")
        batch = self.batch
        batch.play(action, _ALL)
        outcome = batch.outcomes[0]
        ending = self._ending = Ending(outcome["ending"])
        self._show()
        truncated = ending is Ending.OUT_OF_TIME
        return (
            batch.observations[0].copy(),
            float(outcome["reward"]),
            ending > 0 and not truncated,
            truncated,
            self._info(),
        )

    def _info(self) -> StepInfo:
        """Returns the info of the last decision, as a new dictionary; entries about the end are "" or 0 until then."""
        batch = self.batch
        outcome = batch.outcomes[0]
        reasons = batch.refusals(0)
        info: StepInfo = {
            "reward_terms": dict(zip(NAVIGATION_TERMS, outcome["terms"].tolist(), strict=True)),
            "refused": {kind: bool(reason) for kind, reason in reasons.items()},
            "refusal_reason": "; ".join(filter(None, reasons.values())),
            "infractions": dict(zip(INFRACTIONS, batch.infractions[0].tolist(), strict=True)),
        }
        over = bool(self._ending)
        info["is_success"], info["reason"] = over and bool(batch.successes[0]), self._ending.label
        info["subgoals"] = {"live": int(batch.live_subgoals[0]) * over, "reached": int(outcome["reached"]) * over}
        return info

    # --- Pictures -----------------------------------------------------------------------------------------------------

    def _show(self) -> None:
        """Records the current decision for `render()`, and draws it in human mode."""
        if self.render_mode is None:
            return
        self._view.note(self.batch, 0)
        if self.render_mode == "human":
            self.render()

    def render(self) -> NDArray[np.uint8] | None:
        """Draws the Co-Wizard's observation, or the session (see `view`), as `DuoWizardEnv.render`.

        The instructions of the participant are part of the picture.
        """
        return self._view.view.render(self.session)

    def close(self) -> None:
        """Closes the window, if there is one."""
        self._view.view.close()


_ALL = np.ones(1, dtype=np.bool_)
