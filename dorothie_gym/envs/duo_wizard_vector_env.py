"""Vectorised `DuoWizard-v0`: many sessions of three agents in one batch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from dorothie_gym.envs.batched_env import BatchedEnv, Towns
from dorothie_gym.envs.session_view import SessionView, metadata_at
from dorothie_gym.errors import short_repr
from dorothie_gym.evaluation.tier_settings import tier_settings
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.config import ChannelKind, EnvConfig, PerceptionModel, RenderView, checked_view
from dorothie_gym.session.providers import sensor_spaces
from dorothie_gym.session.rewards import term_names
from dorothie_gym.session.scenario import Scenario, scenario_option
from dorothie_gym.session.session_batch import SessionBatch
from dorothie_gym.session.session_log import REFUSABLE
from dorothie_gym.session.spaces.actions import ActionMapping, action_space
from dorothie_gym.session.spaces.fields import SpaceLimits
from dorothie_gym.session.spaces.observations import observation_space
from dorothie_gym.sim.traffic_rules import INFRACTION_KINDS
from dorothie_gym.support.vector_infos import Infos, mask_of, seeds_of

if TYPE_CHECKING:
    from dorothie_gym.session.session_engine import SessionEngine, StepOutcome
    from dorothie_gym.tasks.storyboard import StoryboardTemplate

_AGENTS = {str(role): role for role in AGENT_ROLES}
_KINDS = tuple(kind.value for kind in INFRACTION_KINDS)

Stacked: TypeAlias = dict[str, Any]
"""Observations or masks of one agent in all environments: by field an array (num_envs, ...), or a tuple of texts."""

BatchedActions: TypeAlias = Mapping[str, Mapping[str, Any]] | Sequence[Mapping[str, ActionMapping]]
"""Actions by agent and field, each for all environments; or by environment and agent."""

Flags: TypeAlias = NDArray[np.bool_]


class DuoWizardVectorEnv(BatchedEnv[EnvConfig, SessionBatch]):
    """Many sessions of `DuoWizardEnv` in one batch, by agent as in PettingZoo and stacked as in Gymnasium.

    Worlds, observations and masks of all sessions are in arrays, which compiled code steps on threads; the dialogue is
    computed in Python. A session depends on its seed and its actions, and neither on the others, nor on its place among
    them, nor
    on the number of threads: it is that of a `DuoWizardEnv`.

    Everything is by agent. Of one agent, the values of a field of its observation are an array (num_envs, ...) or, for
    a text, a tuple of `num_envs` texts, as `gymnasium.vector.utils.batch_space` arranges it:
    `{name: values[k] for name, values in observations[agent].items()}` is the observation in environment `k`.
    All agents of a session end together.

    Attributes:
        num_envs: number of environments.
        possible_agents: names of the agents.
        autoreset_mode: when finished sessions are reset, as in `gymnasium.vector.SyncVectorEnv`.
        towns: town of each environment.
        config: settings of the sessions.
        limits: sizes of the spaces, which all towns of the batch share.
        single_observation_spaces: observation space of each agent in one environment.
        single_action_spaces: action space of each agent in one environment.
        observation_spaces: observation space of each agent in all environments.
        action_spaces: action space of each agent in all environments.
        engines: engine of each environment, to be read: of the session in progress, its events, its summary.
    """

    metadata: dict[str, object] = {**BatchedEnv.metadata, "name": "duo_wizard_v0"}  # noqa: RUF012

    MUTABLE_ATTRIBUTES: ClassVar[Sequence[str]] = ("_over",)

    def __init__(
        self,
        num_envs: int = 1,
        town: Towns | None = None,
        storyboard: str | Path | StoryboardTemplate | None = None,
        *,
        config: EnvConfig | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        threads: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        render_view: str = RenderView.MAP,
        tier: str | None = None,
    ) -> None:
        """Makes the environments.

        Args:
            num_envs: number of environments.
            town: a town as in `DuoWizardEnv`, or several over which the environments cycle. "generated" stands for the
                first generated towns: one for each environment, at most 64.
            storyboard: as in `DuoWizardEnv`.
            config: as in `DuoWizardEnv`, with symbolic perception. Pictures of a camera are drawn on the threads.
            render_mode: None or "rgb_array".
            max_cycles: as in `DuoWizardEnv`.
            threads: number of threads; None for one per processor.
            autoreset_mode: see above.
            render_view: as in `DuoWizardEnv`.
            tier: as in `DuoWizardEnv`.

        Raises:
            ValueError: an argument is out of its range.
        """
        usual = tier_settings(tier)
        place, settings = usual.town if town is None else town, usual.config if config is None else config
        if settings is not None and settings.perception is PerceptionModel.CAMERA:
            raise ValueError('config.perception is "camera"; batches do not perceive by it: make single environments')
        if settings is not None and settings.channel is ChannelKind.SPEECH:
            raise ValueError('config.channel is "speech"; batches do not speak: make single environments')
        super().__init__(num_envs, place, settings or EnvConfig(), render_mode, threads, autoreset_mode)
        rate = self.config.decision_frequency
        self.metadata = {**self.metadata, "render_fps": metadata_at(rate)["render_fps"]}
        self.limits = SpaceLimits.for_towns(self.towns)
        self.possible_agents = list(_AGENTS)
        self.single_observation_spaces, self.observation_spaces = self._spaces(
            {agent: self._observed(role) for agent, role in _AGENTS.items()}
        )
        self.single_action_spaces, self.action_spaces = self._spaces(
            {agent: action_space(role, self.limits) for agent, role in _AGENTS.items()}
        )
        self._make_batches(
            lambda each, numbers, threads: SessionBatch(
                each,
                storyboard,
                config=self.config,
                max_cycles=max_cycles,
                limits=self.limits,
                numbers=numbers,
                threads=threads,
            )
        )
        places = [self._places[number] for number in range(num_envs)]
        self.engines: tuple[SessionEngine, ...] = tuple(batch.engines[row] for batch, row in places)
        self._over = np.zeros(num_envs, dtype=np.bool_)
        views = num_envs if render_mode is not None else 0
        view = checked_view(render_view)
        self._views = [SessionView(render_mode, frames_per_second=rate, render_view=view) for _ in range(views)]

    def _observed(self, role: Role) -> spaces.Dict:
        """Returns the observation space of a role in one environment, with its cameras and sensors."""
        space, sensors = (
            observation_space(role, self.limits, self.config.observe_acts),
            sensor_spaces(self.config, role),
        )
        return spaces.Dict({**space.spaces, **sensors}) if sensors else space

    def _spaces(self, single: Mapping[str, spaces.Dict]) -> tuple[dict[str, spaces.Dict], dict[str, spaces.Dict]]:
        """Returns spaces of one environment, and those of all, by agent."""
        batched = {
            agent: spaces.Dict(
                {name: batch_space(part, self.num_envs) for name, part in space.spaces.items()},
                seed=deepcopy(space.np_random),  # as `batch_space` of the whole
            )
            for agent, space in single.items()
        }
        return dict(single), batched

    def observation_space(self, agent: str) -> spaces.Dict:
        """Returns the observation space of an agent in all environments, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Dict:
        """Returns the action space of an agent in all environments, always the same object."""
        return self.action_spaces[agent]

    # --- Episodes -----------------------------------------------------------------------------------------------------

    def reset(
        self, seed: int | Sequence[int | None] | None = None, options: Mapping[str, object] | None = None
    ) -> tuple[dict[str, Stacked], dict[str, Infos]]:
        """Begins new sessions.

        Args:
            seed: seed of the first environment; the others have the numbers that follow. A sequence has one for each.
                By default, the next number after the environment's previous seed.
            options: `reset_mask`, a bool array (num_envs,): which environments, by default all; `scenario` as in
                `DuoWizardEnv`, for all of them; other options are ignored.

        Returns:
            Observations of all environments, and infos of those that begin, by agent.

        Raises:
            ValueError: not one seed for each environment, or a mask of the wrong shape or type.
        """
        mask = mask_of((options or {}).get("reset_mask"), self.num_envs)
        seeds = seeds_of(seed, self.num_envs)
        scenario = scenario_option({name: value for name, value in (options or {}).items() if name == "scenario"})
        self._begin(mask, seeds, scenario)
        for batch in self.batches:
            batch.observe([row for row, number in enumerate(batch.numbers) if mask[number]])
        return self._observations(), self._infos(mask, {})

    def step(
        self, actions: BatchedActions
    ) -> tuple[
        dict[str, Stacked], dict[str, NDArray[np.float64]], dict[str, Flags], dict[str, Flags], dict[str, Infos]
    ]:
        """Steps every environment by one decision; finished ones are reset according to the autoreset mode.

        Args:
            actions: by agent the fields of its action, each an array (num_envs, ...) or a sequence of `num_envs`
                values; or a sequence of `num_envs` dicts with an action for each agent.

        Returns:
            By agent: observations, rewards, terminations and truncations (num_envs,), infos.

        Raises:
            ValueError: an action is missing or malformed; the message names environment, agent and field. Nothing was
                played.
            gymnasium.error.ResetNeeded: an environment was never reset, or has ended and is not reset automatically.
        """
        begun = np.array([engine.has_begun for engine in self.engines])
        mode, again = self.autoreset_mode, self._over.copy()
        if not begun.all() or (mode is AutoresetMode.DISABLED and again.any()):
            waiting = np.flatnonzero(~begun | again).tolist()
            raise gym.error.ResetNeeded(f"environments {short_repr(waiting)} wait for a reset: call reset()")
        outcomes = self._play(rows_of(actions, self.num_envs, self.possible_agents), ~again)
        self._begin(again, [None] * self.num_envs, None)
        for batch in self.batches:
            batch.observe()
        played = [outcomes.get(number) for number in range(self.num_envs)]
        rewards = {
            agent: np.array([0.0 if each is None else float(sum(each.reward_terms[role].values())) for each in played])
            for agent, role in _AGENTS.items()
        }
        terminated = np.array([each is not None and each.terminated for each in played])
        truncated = np.array([each is not None and each.truncated for each in played])
        self._over = terminated | truncated
        observations, infos = self._observations(), self._infos(np.ones(self.num_envs, dtype=np.bool_), outcomes)
        if mode is AutoresetMode.SAME_STEP and self._over.any():
            observations, infos = self._begin_at_once(observations, outcomes)
        return (
            observations,
            rewards,
            {agent: terminated.copy() for agent in _AGENTS},
            {agent: truncated.copy() for agent in _AGENTS},
            infos,
        )

    def render_one(self, number: int) -> NDArray[np.uint8] | None:
        """Draws the session of one environment, as `DuoWizardEnv` does; None without a render mode."""
        engine = self.engines[range(self.num_envs)[number]]
        return self._views[number].render(engine.session) if self._views else None

    def close(self) -> None:
        """Ends the threads."""
        for batch in self.batches:
            batch.close()

    # --- Parts of a step ----------------------------------------------------------------------------------------------

    def _play(self, actions: Sequence[Mapping[str, ActionMapping]], playing: Flags) -> dict[int, StepOutcome]:
        """Steps the given environments by one decision; returns the outcomes by number of the environment."""
        decoded = [
            batch.decode({row: actions[number] for row, number in enumerate(batch.numbers) if playing[number]})
            for batch in self.batches
        ]
        outcomes = {}
        for batch, own in zip(self.batches, decoded, strict=True):
            if own:
                outcomes.update({batch.numbers[row]: outcome for row, outcome in batch.step(own).items()})
        return outcomes

    def _begin(self, mask: Flags, seeds: Sequence[int | None], scenario: Scenario | None) -> None:
        """Begins sessions in the environments of a mask."""
        for batch in self.batches:
            for row, number in enumerate(batch.numbers):
                if mask[number]:
                    batch.begin(row, seeds[number], scenario)
                    if self._views:
                        self._views[number].begin(self.engines[number].session)
        self._over[mask] = False

    def _begin_at_once(
        self, last: Mapping[str, Stacked], outcomes: Mapping[int, StepOutcome]
    ) -> tuple[dict[str, Stacked], dict[str, Infos]]:
        """Resets finished sessions; returns observations and infos as in the mode `SAME_STEP`."""
        over = self._over.copy()
        ended = self._infos(over, outcomes)
        self._begin(over, [None] * self.num_envs, None)
        for batch in self.batches:
            batch.observe([row for row, number in enumerate(batch.numbers) if over[number]])
        infos = self._infos(np.ones(self.num_envs, dtype=np.bool_), {k: v for k, v in outcomes.items() if not over[k]})
        for agent, seen in last.items():
            final = np.full(self.num_envs, None, dtype=object)
            for number in np.flatnonzero(over).tolist():
                final[number] = {name: values[number] for name, values in seen.items()}
            infos[agent] |= {"final_obs": final, "_final_obs": over.copy()}
            infos[agent] |= {"final_info": ended[agent], "_final_info": over.copy()}
        return self._observations(), infos

    # --- Results ------------------------------------------------------------------------------------------------------

    def _observations(self) -> dict[str, Stacked]:
        """Returns a copy of the observations of all environments, by agent."""
        found = {}
        for agent, role in _AGENTS.items():
            own = found[agent] = self._gathered([batch.views.observations[role].copy() for batch in self.batches])
            for name in self.batches[0].views.texts[role]:
                texts = [""] * self.num_envs
                for batch in self.batches:
                    for number, text in zip(batch.numbers, batch.views.texts[role][name], strict=True):
                        texts[number] = text
                own[name] = tuple(texts)
            if sensors := sensor_spaces(self.config, role):
                own |= self._gathered([_copies_of(batch.pictures, sensors) for batch in self.batches])
        return found

    def _gathered(self, parts: Sequence[Mapping[str, NDArray[Any]]]) -> Stacked:
        """Returns the arrays of all batches as arrays of all environments."""
        if len(parts) == 1:
            return dict(parts[0])
        order = np.argsort(np.concatenate(self._members), kind="stable")
        return {name: np.concatenate([part[name] for part in parts])[order] for name in parts[0]}

    def _infos(self, mask: Flags, outcomes: Mapping[int, StepOutcome]) -> dict[str, Infos]:
        """Returns the infos of the environments of a mask, by agent; reward terms of those without an outcome are 0."""
        infos: dict[str, Infos] = {}
        (infractions,) = self._gathered([{"": batch.infractions.copy()} for batch in self.batches]).values()
        infractions[~mask] = 0
        stepped = np.zeros(self.num_envs, dtype=np.bool_)
        stepped[list(outcomes)] = True
        stepped &= mask
        rows, numbers = np.flatnonzero(stepped).tolist(), np.flatnonzero(mask).tolist()
        for agent, role in _AGENTS.items():
            masks = self._gathered([batch.views.masks[role].copy() for batch in self.batches])
            refused = np.zeros((self.num_envs, len(REFUSABLE[role])), dtype=np.bool_)
            reasons = np.full(self.num_envs, None, dtype=object)
            for number in numbers:
                found = self.engines[number].session.log.refusals[role].values()
                refused[number] = [bool(reason) for reason in found]
                reasons[number] = "; ".join(filter(None, found))
            infos[agent] = info = {
                "action_mask": {**masks, **dict.fromkeys(self.batches[0].views.unmasked[role])},
                "_action_mask": mask.copy(),
                "refused": _columns(REFUSABLE[role], refused, mask),
                "_refused": mask.copy(),
                "refusal_reason": reasons,
                "_refusal_reason": mask.copy(),
                "infractions": _columns(_KINDS, infractions.copy(), mask),
                "_infractions": mask.copy(),
            }
            table = np.zeros((self.num_envs, len(term_names(role))))
            for number in rows:
                table[number] = [*outcomes[number].reward_terms[role].values()]
            info["reward_terms"], info["_reward_terms"] = _columns(term_names(role), table, mask), mask.copy()
        return infos


def _copies_of(arrays: Mapping[str, NDArray[Any]], names: Iterable[str]) -> dict[str, NDArray[Any]]:
    return {name: arrays[name].copy() for name in names}


def _columns(names: Sequence[str], table: NDArray[np.generic], mask: Flags) -> Infos:
    """Returns the columns of a table (num_envs, n) as infos of the environments of a mask."""
    infos: Infos = {}
    for k, name in enumerate(names):
        infos[name], infos[f"_{name}"] = table[:, k], mask.copy()
    return infos


def rows_of(actions: object, count: int, agents: Sequence[str]) -> Sequence[Mapping[str, ActionMapping]]:
    """Returns the actions of each environment by agent.

    Args:
        actions: see `DuoWizardVectorEnv.step`.
        count: number of environments.
        agents: names of the agents.

    Raises:
        ValueError: `actions` has another form, or does not have one value per environment.
    """
    if isinstance(actions, Mapping):
        if missing := [agent for agent in agents if agent not in actions]:
            raise ValueError(f"the action of {missing[0]} is missing; it is needed from {', '.join(agents)}")
        stacks = [_unstacked(agent, actions[agent], count) for agent in agents]
        return [dict(zip(agents, own, strict=True)) for own in zip(*stacks, strict=True)]
    if not isinstance(actions, Sequence) or isinstance(actions, str) or len(actions) != count:
        raise ValueError(
            f"actions is {short_repr(actions)}; it must be a dict of stacked actions by agent, or {count} dicts"
        )
    return actions


def _unstacked(agent: str, fields: object, count: int) -> list[dict[str, object]]:
    if not isinstance(fields, Mapping):
        raise ValueError(f"action of {agent}: expected a dict, got {type(fields).__name__}")
    columns = []
    for name, values in fields.items():
        listed = isinstance(values, Sequence) and not isinstance(values, str)
        if not (listed or (isinstance(values, np.ndarray) and values.ndim)) or len(values) != count:
            raise ValueError(
                f"action of {agent}: field {name!r} is {short_repr(values)}; it must have {count} values, "
                "one for each environment"
            )
        one_each = isinstance(values, np.ndarray) and values.ndim == 1
        columns.append(values.tolist() if one_each else list(values))
    return [dict(zip(fields, own, strict=True)) for own in zip(*columns, strict=True)]
