"""Checkpoints of stable-baselines3 models without pickles: tensors in safetensors, everything else in JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file

from dorothie_gym.baselines.rl.environments import make_env
from dorothie_gym.baselines.rl.settings import ALGORITHMS, FINAL_RATE, TrainingSettings
from dorothie_gym.errors import ModelFileError, SettingsError
from dorothie_gym.files import replacing

TENSORS, DESCRIPTION = "model.safetensors", "model.json"
"""Files of a model in its folder."""

KIND = "dorothie_gym-rl"
"""Kind of the models of `train-rl` in `model.json`; `policy_loader` plays files by it."""

FORMAT = 1
"""Version of the two files."""


def make_model(settings: TrainingSettings, env: Any, *, log: Path | None = None) -> Any:
    """Returns an untrained model.

    Args:
        settings: settings of the training.
        env: an environment, or a vector of them.
        log: folder for TensorBoard, or None.

    Raises:
        SettingsError: the algorithm does not take the environment's actions, or a parameter.
    """
    package, name = ALGORITHMS[settings.algorithm]
    parameters = dict(settings.parameters)
    last = parameters.pop(FINAL_RATE, None)
    if last is not None:
        parameters["learning_rate"] = LinearSchedule(float(parameters["learning_rate"]), float(last))
    try:
        return getattr(import_module(package), name)(
            "MlpPolicy", env, policy_kwargs={"net_arch": list(settings.network)}, seed=settings.seed,
            tensorboard_log=None if log is None else str(log), device="cpu", **parameters,
        )  # fmt: skip
    except (AssertionError, TypeError, ValueError) as error:
        raise SettingsError(f"{settings.algorithm} on {settings.env}: {error}") from error


class LinearSchedule:
    """Linearly falling learning rate."""

    def __init__(self, first: float, last: float) -> None:
        self._first, self._last = first, last

    def __call__(self, remaining: float) -> float:
        """Returns the rate for a share of remaining steps."""
        return self._last + (self._first - self._last) * remaining


def save_model(
    model: Any, settings: Any, folder: Path, seconds: float, more: Mapping[str, Any] | None = None
) -> None:  # fmt: skip
    """Writes a model with the state of its optimisers into a folder; an older one stays whole until it is replaced.

    Replay buffers are not saved.

    Args:
        model: of stable-baselines3.
        settings: settings of the training; has `as_json`.
        folder: folder of the two files.
        seconds: duration of the training [s].
        more: further fields of the description.
    """
    tensors: dict[str, torch.Tensor] = {}
    groups: dict[str, Any] = {}
    for name, state in model.get_parameters().items():
        if "param_groups" in state:
            groups[name] = state["param_groups"]
            for index, values in state["state"].items():
                for key, value in values.items():
                    tensors[f"{name}/{index}/{key}"] = torch.as_tensor(value)
        else:
            tensors |= {f"{name}/{key}": value for key, value in state.items()}
    tensors |= {f"variables/{name}": value for name, value in _variables(model)}
    description = {
        "format": FORMAT,
        "kind": KIND,
        **(more or {}),
        "settings": settings.as_json(),
        "steps": int(model.num_timesteps),
        "seconds": round(seconds, 2),
        "updates": int(getattr(model, "_n_updates", 0)),
        "optimisers": groups,
    }
    folder.mkdir(parents=True, exist_ok=True)
    with replacing(folder / DESCRIPTION) as about, replacing(folder / TENSORS) as weights:
        save_file({name: value.detach().contiguous().clone() for name, value in tensors.items()}, weights)
        about.write_text(json.dumps(description, indent=1) + "\n", encoding="utf-8")


def read_description(folder: Path) -> dict[str, Any]:
    """Returns the content of `model.json` in a folder.

    Raises:
        ModelFileError: it is missing, or not as it must be.
    """
    path = folder / DESCRIPTION
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ModelFileError(f"{path}: does not exist; `dorothie-gym train-rl --out {folder}` makes one") from None
    except json.JSONDecodeError as error:
        raise ModelFileError(f"{path}, line {error.lineno}: {error.msg}") from None
    if not isinstance(found, dict) or found.get("format") != FORMAT:
        raise ModelFileError(f"{path}: format is not {FORMAT}; the model is of another version of dorothie_gym")
    return found


def restore(model: Any, folder: Path) -> None:
    """Restores weights, optimisers and step count of a model from a folder.

    Raises:
        ModelFileError: the files are missing or damaged, or of a model with other layers.
    """
    description = read_description(folder)
    path = folder / TENSORS
    try:
        tensors = load_file(path)
    except (SafetensorError, OSError) as error:
        raise ModelFileError(f"{path}: cannot be read ({error})") from None
    variables = {name.split("/", 1)[1]: value for name, value in tensors.items() if name.startswith("variables/")}
    parameters = {
        name: _optimiser(name, description["optimisers"], tensors)
        if name in description["optimisers"]
        else _under(f"{name}/", tensors)
        for name in model.get_parameters()
    }
    try:
        model.set_parameters(parameters, exact_match=True, device="cpu")
    except (ValueError, RuntimeError, KeyError) as error:
        raise ModelFileError(f"{path}: does not fit the environment or the network ({error})") from None
    for name, value in _variables(model):
        value.data.copy_(variables[name])
    model.num_timesteps, model._n_updates = int(description["steps"]), int(description["updates"])


def load_model(folder: str | Path) -> tuple[Any, TrainingSettings]:
    """Returns a trained model and the settings of its training.

    Args:
        folder: folder of `train-rl`, or `model.json` or `model.safetensors` in it.

    Raises:
        ModelFileError: the files are missing or damaged.
        SettingsError: the environment that it was trained in cannot be made.
    """
    folder = Path(folder)
    folder = folder.parent if folder.is_file() else folder
    settings = TrainingSettings(**read_description(folder)["settings"])
    env = make_env(settings.env, settings.env_settings)
    model = make_model(_for_one(settings), env)
    restore(model, folder)
    return model, settings


def _for_one(settings: TrainingSettings) -> TrainingSettings:
    """Returns the settings for a single environment, with a batch size that it can fill."""
    parameters = dict(settings.parameters)
    if {"n_steps", "batch_size"} <= set(parameters):
        parameters["batch_size"] = math.gcd(parameters["n_steps"], parameters["batch_size"])
    return replace(settings, parameters=parameters)


def _variables(model: Any) -> Iterator[tuple[str, torch.Tensor]]:
    """Yields tensors of an algorithm outside its networks (SAC: the logarithm of its temperature)."""
    for name in model._get_torch_save_params()[1]:
        value = getattr(model, name)
        if value is not None:
            yield name, value


def _under(prefix: str, tensors: Mapping[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    return {name[len(prefix) :]: value for name, value in tensors.items() if name.startswith(prefix)}


def _optimiser(name: str, groups: Mapping[str, Any], tensors: Mapping[str, torch.Tensor]) -> dict[str, Any]:
    state: dict[int, dict[str, torch.Tensor]] = {}
    for key, value in _under(f"{name}/", tensors).items():
        index, quantity = key.split("/")
        state.setdefault(int(index), {})[quantity] = value
    return {"state": state, "param_groups": groups[name]}
