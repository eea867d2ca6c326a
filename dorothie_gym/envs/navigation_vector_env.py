"""Vectorised `Navigation-v0`, the result of `gymnasium.make_vec`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from dorothie_gym.action_values import as_array
from dorothie_gym.engine.scenario import Scenario, template_option
from dorothie_gym.engine.session_engine import LiveSession
from dorothie_gym.envs.driving_batch import DrivingBatch
from dorothie_gym.envs.driving_vector_env import DrivingVectorEnv, Towns
from dorothie_gym.envs.episode import Ending
from dorothie_gym.envs.navigation_config import NavigationConfig, NavigationWeights, weights_of
from dorothie_gym.envs.session_view import SessionView
from dorothie_gym.errors import short_repr
from dorothie_gym.maps import Town
from dorothie_gym.ontology import Role
from dorothie_gym.policies.navigation.actions import ACTIONS
from dorothie_gym.policies.navigation.instructor import Guidance, words_of
from dorothie_gym.policies.navigation.observation_vector import DECISION_FREQUENCY, navigation_space
from dorothie_gym.processors import available_processors
from dorothie_gym.tasks import StoryboardTemplate
from dorothie_gym.vector_infos import Infos, masked_infos


class DrivingView:
    """Pictures of an environment of a batch; without a render mode there is none.

    Attributes:
        view: the picture.
    """

    def __init__(self, view: SessionView) -> None:
        self.view = view
        self._live: LiveSession | None = None
        self._shown = -math.inf  # time of the last instruction that was noted [s]

    def note(self, batch: DrivingBatch, place: int) -> None:
        """Notes the present decision of an environment."""
        live, said = batch.catch_up(place), batch.instruction(place)
        if live is self._live:
            live.begin_decision()
            live.note_place()
        else:
            self._live, self._shown = live, -math.inf
            self.view.begin(live)
        if said is not None and said.time > self._shown:
            self.view.note_instruction(said.time, words_of(said), str(said.act))
            self._shown = said.time
        self.view.note(live.observations((Role.CO_WIZARD,))[Role.CO_WIZARD])


class NavigationVectorEnv(DrivingVectorEnv):
    """Vectorised `NavigationEnv`: observations, rewards, masks and infos are those of single environments.

    ## Observation Space
    `Box(-1, 1, (num_envs, 161), float32)`, see `NavigationEnv`.

    ## Action Space
    `MultiDiscrete([18] * num_envs)`. `infos["action_mask"]` (num_envs, 18) marks the feasible actions, and so does
    `action_masks()`, which sb3-contrib calls.

    ## Episode End
    As `NavigationEnv`. `metadata["autoreset_mode"]` selects the reset: by default an environment that ended is reset by
    the next step, whose action it ignores.

    ## Arguments
    - `num_envs`: how many environments.
    - `town`: a town as in `NavigationEnv`, or a sequence of them, which the environments play in turn.
    - `threads`: how many step the environments at most, by default one per processor.
    - `autoreset_mode`: Gymnasium's. `options["reset_mask"]` of `reset` resets some environments only.
    - `render_mode`: None or `"rgb_array"`; `render()` draws the first environment, `render_one(number)` any.
    - The others as in `NavigationEnv`.

    ## Version History
    - v0: first version.

    Attributes:
        config: settings.
        batches: a batch for each town.
    """

    CHANGES: ClassVar[Sequence[str]] = (*DrivingVectorEnv.CHANGES, "_masks")

    def __init__(
        self,
        num_envs: int = 1,
        town: Towns = "brookside",
        storyboard: str | Path | StoryboardTemplate | None = None,
        *,
        guidance: Guidance | str = Guidance.TURNS,
        traffic: str = "light",
        exceptions: float = 0.0,
        reward: str | NavigationWeights = "dense",
        max_seconds: float = 600.0,
        patience: float = 60.0,
        render_mode: str | None = None,
        view: str = "role",
        threads: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    ) -> None:
        if threads is not None and threads < 1:
            raise ValueError(f"threads is {threads}; it must be at least 1, or None for one per processor")
        super().__init__(
            num_envs, town, navigation_space(), spaces.Discrete(len(ACTIONS)), DECISION_FREQUENCY, render_mode,
            autoreset_mode,
        )  # fmt: skip
        self.config = NavigationConfig(
            guidance=guidance, traffic=traffic, exceptions=exceptions, weights=weights_of(reward),
            max_seconds=max_seconds, patience=patience,
        )  # fmt: skip
        template, threads = template_option(storyboard), threads or available_processors()
        towns: dict[Town, list[int]] = {}
        for number, each in enumerate(self.towns):
            towns.setdefault(each, []).append(number)
        self._members = [np.array(numbers) for numbers in towns.values()]
        self.batches = [
            DrivingBatch(each, template, self.config, len(numbers), threads) for each, numbers in towns.items()
        ]
        self._places = {
            int(number): (batch, place)
            for batch, numbers in zip(self.batches, self._members, strict=True)
            for place, number in enumerate(numbers)
        }
        self._masks = np.zeros((num_envs, len(ACTIONS)), dtype=np.int8)
        self._views = [
            DrivingView(SessionView.of_role(Role.CO_WIZARD, view, render_mode, DECISION_FREQUENCY))
            for _ in range(num_envs if render_mode is not None else 0)
        ]

    @property
    def threads(self) -> int:
        """Number of threads that step the environments."""
        return max(batch.threads for batch in self.batches)

    @property
    def nbytes(self) -> int:
        """Memory of the environments' arrays [bytes]."""
        return sum(batch.nbytes for batch in self.batches)

    def action_masks(self) -> NDArray[np.bool_]:
        """Returns which actions are feasible now (num_envs, 18)."""
        return self._masks.astype(np.bool_)

    def render_one(self, number: int) -> NDArray[np.uint8] | None:
        """Draws one of the environments (800, 1280, 3), as the single environment does."""
        batch, place = self._places[range(self.num_envs)[number]]
        view = self._views[number].view if self._views else SessionView(None, frames_per_second=DECISION_FREQUENCY)
        return view.render(batch.catch_up(place))

    # --- States -------------------------------------------------------------------------------------------------------

    def mutable_values(self) -> dict[str, object]:
        """Returns what changes in the environments."""
        return {**super().mutable_values(), "batches": [batch.mutable_values() for batch in self.batches]}

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values of the environments; pictures begin anew."""
        parts = values.pop("batches")
        assert isinstance(parts, list)  # of `mutable_values`
        for batch, part in zip(self.batches, parts, strict=True):
            batch.apply_values(part)
        super().apply_values(values)

    def compatibility(self) -> dict[str, object]:
        """Returns the kind of environment, the towns and the settings."""
        return {**super().compatibility(), "the settings": self.config}

    def close_extras(self, **_kwargs: object) -> None:
        """Ends the threads."""
        for batch in self.batches:
            batch.close()

    # --- Episodes -----------------------------------------------------------------------------------------------------

    def _checked(self, actions: object) -> NDArray[np.int64]:
        found = as_array("actions", actions)
        if found.shape != (self.num_envs,) or found.dtype.kind not in "iu":
            raise ValueError(f"actions is {short_repr(found)}; it must be {self.num_envs} whole numbers")
        if found.min() < 0 or found.max() >= len(ACTIONS):
            raise ValueError(f"actions is {short_repr(found)}; the numbers must be in 0..{len(ACTIONS) - 1}")
        return found.astype(np.int64)

    def _start(self, seeds: Mapping[int, int], scenario: Scenario | None) -> None:
        for batch, members in zip(self.batches, self._members, strict=True):
            own = {place: seeds[number] for place, number in enumerate(members.tolist()) if number in seeds}
            if own:
                batch.begin(own, scenario)
                begun = np.zeros(len(members), dtype=np.bool_)
                begun[list(own)] = True
                self._note(batch, members, begun)

    def _play(self, actions: NDArray[np.generic], playing: NDArray[np.bool_]) -> None:
        for batch, members in zip(self.batches, self._members, strict=True):
            if playing[members].any():
                batch.play(actions[members], playing[members])
                self._note(batch, members, playing[members])

    def _note(self, batch: DrivingBatch, members: NDArray[np.int64], changed: NDArray[np.bool_]) -> None:
        """Copies the outcomes of some environments of a batch."""
        numbers, outcomes = members[changed], batch.outcomes[changed]
        self._observations[numbers], self._masks[numbers] = batch.observations[changed], batch.masks[changed]
        self._rewards[numbers], self._terms[numbers] = outcomes["reward"], outcomes["terms"]
        self._infractions[numbers] = batch.infractions[changed]
        truncated = outcomes["ending"] == Ending.OUT_OF_TIME
        self._truncations[numbers], self._terminations[numbers] = truncated, (outcomes["ending"] > 0) & ~truncated
        refused = batch.any_refused
        for place in np.flatnonzero(changed).tolist():
            self._refused[members[place]] = batch.refused(place) if refused[place] else []
        for number in numbers.tolist() if self._views else ():
            self._views[number].note(*self._places[number])
        over = numbers[outcomes["ending"] > 0]
        if over.size:
            self._success[numbers] = batch.successes[changed]
            self._subgoals[numbers, 0] = batch.live_subgoals[changed]
            self._subgoals[numbers, 1] = outcomes["reached"]
            for number, ending in zip(numbers.tolist(), outcomes["ending"].tolist(), strict=True):
                self._reasons[number] = Ending(ending).label if ending else None

    def _infos(self, mask: NDArray[np.bool_]) -> Infos:
        return {**masked_infos({"action_mask": self._masks}, mask), **super()._infos(mask)}
