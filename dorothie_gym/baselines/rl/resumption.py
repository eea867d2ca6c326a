"""Checkpoint of a run: one file with the full state from which the run continues as if uninterrupted.

It is written between two rollouts and replaced in one step. It holds weights and optimisers, step counts, the states of
all random generators, the rows of the learning curve, and a replay buffer if there is one. Environments are stored as
the starts of their episodes and the actions since then, which a resumed run repeats (`RepeatableEpisodes`).
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecTransposeImage

from dorothie_gym.baselines.rl.checkpoint import (
    Model,
    check_parameters,
    parameters_of,
    refusing_misfits,
    set_parameters,
)
from dorothie_gym.baselines.rl.repeatable_batch import Episode, RepeatableVecEnv
from dorothie_gym.baselines.rl.settings import Page
from dorothie_gym.baselines.tensor_files import read_tensors, save_tensors
from dorothie_gym.errors import InputFileError, ModelFileError, short_repr
from dorothie_gym.support.files import replacing
from dorothie_gym.support.input_files import MIB, parse_json, raising

CHECKPOINT: Final = "checkpoint.safetensors"
"""File of a run with its state after the last checkpoint."""

MAX_CHECKPOINT: Final = 16 * 1024 * MIB
"""Largest checkpoint [bytes]; replay buffers take some hundred MB."""

CHECKPOINT_FORMAT: Final = 1
"""Version of the file."""

Tensors: TypeAlias = dict[str, torch.Tensor]
"""Tensors of a file by name."""

_PAGE: Final = "dorothie_gym"
"""Name of the file's metadata: an object in JSON."""


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """Content of a checkpoint.

    Attributes:
        path: the file.
        page: values in JSON types.
        tensors: arrays by name.
    """

    path: Path
    page: Page
    tensors: Tensors


def write_checkpoint(folder: Path, page: Page, tensors: Tensors) -> None:
    """Writes the checkpoint of a run into its folder, whole or not at all.

    Raises:
        OSError: the file cannot be written.
    """
    text = json.dumps({"format": CHECKPOINT_FORMAT, **page}, allow_nan=False)
    own = {name: value.detach().contiguous().clone() for name, value in tensors.items()}
    with replacing(folder / CHECKPOINT) as part:
        save_tensors(own, part, {_PAGE: text})


def read_checkpoint(folder: Path) -> Checkpoint | None:
    """Returns the checkpoint in a folder; None if there is none.

    Raises:
        ModelFileError: the file is damaged, or of another version.
    """
    path = folder / CHECKPOINT
    try:
        tensors, metadata = read_tensors(path, MAX_CHECKPOINT)
        page = parse_json(metadata.get(_PAGE, ""), path)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise ModelFileError(f"{path}: cannot be read ({error.strerror}); start the run in another folder") from None
    except InputFileError as error:
        raise ModelFileError(f"{error}; start the run in another folder") from None
    if not isinstance(page, dict) or page.get("format") != CHECKPOINT_FORMAT:
        raise ModelFileError(
            f"{path}: format is not {CHECKPOINT_FORMAT}; the run is of another version of dorothie_gym, start another"
        )
    return Checkpoint(path, dict(page), tensors)


# --- State of a model of stable-baselines3 between two rollouts -------------------------------------------------------

_COUNTERS: Final = ("_episode_num", "_n_calls", "exploration_rate", "_current_progress_remaining")
"""Numbers of an algorithm, if it has them, in addition to those that `parameters_of` returns."""

_BUFFER: Final = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays of a replay buffer (rows, environments, ...)."""


_ARRAYS: Final = frozenset(
    [
        "torch", "numpy", "observations", "starts", "returns", "lengths", "past_returns", "past_lengths",
        "past_successes", "logged", "actions", "buffer",
    ]
)  # fmt: skip
"""Tensors in addition to those that `parameters_of` returns, or the part of their names before the slash."""


def state_of(model: Model) -> tuple[Page, Tensors]:
    """Returns the state of a model, its environments and the global random generators between two rollouts."""
    parameters, tensors = parameters_of(model)
    vector: VecMonitor = model.env
    legacy: Any = np.random.get_state(legacy=False)
    episodes = vector.env_method("recorded_episodes" if is_batch(vector) else "recorded_episode")
    logged = model.logger.name_to_value
    page: Page = {
        "parameters": parameters,
        "counters": {name: getattr(model, name) for name in _COUNTERS if hasattr(model, name)},
        "numpy": {"pos": legacy["state"]["pos"], "has_gauss": legacy["has_gauss"], "gauss": legacy["gauss"]},
        "sampled_actions": model.action_space.np_random.bit_generator.state,
        "episodes": [start for start, _ in episodes],
        "logged": {name: list(model.logger.name_to_excluded[name]) for name in logged},
    }
    tensors |= {
        "torch": torch.get_rng_state(),
        "numpy": _tensor(legacy["state"]["key"]),
        "observations": _tensor(model._last_obs),
        "starts": _tensor(model._last_episode_starts),
        "returns": _tensor(vector.episode_returns),
        "lengths": _tensor(vector.episode_lengths),
        "past_returns": _tensor(np.array([info["r"] for info in model.ep_info_buffer], dtype=np.float32)),
        "past_lengths": _tensor(np.array([info["l"] for info in model.ep_info_buffer], dtype=np.int32)),
        "past_successes": _tensor(np.array(model.ep_success_buffer, dtype=np.float64)),
        "logged": _tensor(np.array(list(logged.values()), dtype=np.float64)),
    }
    tensors |= {f"actions/{k}": _tensor(actions) for k, (_, actions) in enumerate(episodes)}
    if isinstance(model, OffPolicyAlgorithm):
        buffer: Any = model.replay_buffer
        page["buffer"] = {"pos": buffer.pos, "full": buffer.full}
        rows = buffer.buffer_size if buffer.full else buffer.pos
        tensors |= {f"buffer/{name}": _tensor(getattr(buffer, name)[:rows]) for name in _BUFFER}
    return page, tensors


def restore_state(model: Model, checkpoint: Checkpoint) -> None:
    """Restores the state returned by `state_of` in a model with new environments and a logger.

    Raises:
        ModelFileError: the checkpoint does not match the model, or an environment does not repeat its episode exactly.
    """
    with raising(ModelFileError):
        own = {name: value for name, value in checkpoint.tensors.items() if name.split("/", 1)[0] not in _ARRAYS}
        check_parameters(checkpoint.path, model, own)
    with refusing_misfits(checkpoint.path):
        _restore(model, checkpoint.page, checkpoint.tensors)
        episodes = [
            (start, checkpoint.tensors[f"actions/{k}"].numpy()) for k, start in enumerate(checkpoint.page["episodes"])
        ]
        repeated: Any = _repeat(model.env, episodes)
        if isinstance(model.env, VecTransposeImage):  # stable-baselines3's own wrapper, for channels first
            repeated = model.env.transpose_observations(np.asarray(repeated))
    if not np.array_equal(np.asarray(repeated, dtype=model._last_obs.dtype), model._last_obs, equal_nan=True):
        raise ModelFileError(
            f"{checkpoint.path}: the environments do not repeat their episodes exactly; they are of another version or "
            "depend on more than their seed and the actions. Start the run in another folder"
        )


def is_batch(vector: VecEnv) -> bool:
    """Returns whether the environments are one batch, see `RepeatableVecEnv`."""
    return isinstance(vector.unwrapped, RepeatableVecEnv)


def _repeat(vector: VecEnv, episodes: Sequence[Episode]) -> Sequence[Any]:
    """Repeats recorded episodes, one in each environment; returns their last observations."""
    if is_batch(vector):
        return vector.env_method("repeat_episodes", episodes)
    return [vector.env_method("repeat_episode", *episode, indices=[k])[0] for k, episode in enumerate(episodes)]


def _restore(model: Model, page: Page, tensors: Mapping[str, torch.Tensor]) -> None:
    set_parameters(model, page["parameters"], tensors)
    for name, value in page["counters"].items():
        if name not in _COUNTERS or not isinstance(value, int | float):
            raise ValueError(f"counters.{name} is {short_repr(value)}")
        setattr(model, name, value)
    vector: VecMonitor = model.env
    model._last_obs, model._last_episode_starts = tensors["observations"].numpy(), np.ones(model.n_envs, dtype=bool)
    model._last_episode_starts[:] = tensors["starts"].numpy()
    vector.episode_returns[:], vector.episode_lengths[:] = tensors["returns"].numpy(), tensors["lengths"].numpy()
    size = model._stats_window_size
    past = zip(tensors["past_returns"].numpy(), tensors["past_lengths"].numpy(), strict=True)
    model.ep_info_buffer = deque(({"r": reward, "l": length} for reward, length in past), size)
    model.ep_success_buffer = deque(tensors["past_successes"].tolist(), size)
    for (name, excluded), value in zip(page["logged"].items(), tensors["logged"].tolist(), strict=True):
        model.logger.name_to_value[name], model.logger.name_to_excluded[name] = value, tuple(excluded)
    if isinstance(model, OffPolicyAlgorithm):
        buffer: Any = model.replay_buffer
        buffer.pos, buffer.full = page["buffer"]["pos"], page["buffer"]["full"]
        rows = buffer.buffer_size if buffer.full else buffer.pos
        for name in _BUFFER:
            getattr(buffer, name)[:rows] = tensors[f"buffer/{name}"].numpy()
    model.action_space.np_random.bit_generator.state = page["sampled_actions"]
    torch.set_rng_state(tensors["torch"])
    key, position = tensors["numpy"].numpy(), page["numpy"]["pos"]
    if not 0 <= position <= len(key):  # NumPy reads the key there
        raise ValueError(f"numpy.pos is {short_repr(position)}")
    np.random.set_state({**page["numpy"], "bit_generator": "MT19937", "state": {"key": key, "pos": position}})


def _tensor(values: NDArray[Any]) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(values))
