"""Models of stable-baselines3 and their files without pickles: tensors in safetensors, everything else in JSON."""

from __future__ import annotations

import functools
import itertools
import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import torch
from stable_baselines3.common.vec_env import VecEnv

from dorothie_gym.baselines.rl.environments import make_env_of_model
from dorothie_gym.baselines.rl.fine_inputs import FineInputs
from dorothie_gym.baselines.rl.picture_features import PictureFeatures
from dorothie_gym.baselines.rl.settings import (
    ALGORITHMS,
    FINAL_ENTROPY,
    FINAL_RATE,
    ON_POLICY,
    Page,
    TrainingSettings,
)
from dorothie_gym.baselines.tensor_files import (
    check_optimiser,
    check_tensors,
    read_header,
    read_tensors,
    refuse_unknown,
    save_tensors,
)
from dorothie_gym.errors import ModelFileError, SettingsError, one_line, short_repr
from dorothie_gym.policies.policy import DESCRIPTION
from dorothie_gym.support.files import replacing
from dorothie_gym.support.input_files import MAX_MODEL_JSON, checked, raising, read_json

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl.vector_env import AnyEnv

Model: TypeAlias = Any
"""Algorithm of stable-baselines3 or sb3-contrib: algorithms differ in attributes, and sb3-contrib has no types."""

Network: TypeAlias = Any
"""Policy network of a `Model`, for the same reasons without a type."""

TENSORS: Final = "model.safetensors"
"""File of a model next to `model.json`."""

KIND: Final = "dorothie_gym-rl"
"""Kind of the models of `train-rl` in `model.json`; `policy_loader` selects the loader of a file by it."""

MODEL_FORMAT: Final = 1
"""Version of the two files."""


def make_model(settings: TrainingSettings, env: AnyEnv | VecEnv, device: str = "cpu") -> Model:
    """Returns an untrained model.

    Args:
        settings: settings of the training.
        env: an environment, or a vector of them.
        device: device of the networks, as torch names it: `cpu`, `cuda`, `cuda:1`.

    Raises:
        SettingsError: the algorithm does not accept the environment's actions, or a parameter; or this machine has no
            such device.
    """
    _check_device(device)
    package, name = ALGORITHMS[settings.algorithm]
    parameters = dict(settings.parameters)
    last = parameters.pop(FINAL_RATE, None)
    parameters.pop(FINAL_ENTROPY, None)  # see `training.EntropySchedule`
    if last is not None:
        parameters["learning_rate"] = LinearSchedule(float(parameters["learning_rate"]), float(last))
    policy: dict[str, object] = {"net_arch": list(settings.network)}
    if settings.sees:
        policy["features_extractor_class"] = PictureFeatures
        policy["features_extractor_kwargs"] = {"channels": settings.channels}
    elif settings.fine_inputs:
        policy["features_extractor_class"] = FineInputs
    try:
        return getattr(import_module(package), name)(
            "CnnPolicy" if settings.sees else "MlpPolicy",
            env,
            policy_kwargs=policy,
            seed=settings.seed,
            device=device,
            **parameters,
        )
    except (AssertionError, TypeError, ValueError) as error:
        unfit = isinstance(error, AssertionError) and "as action spaces" in str(error)
        reason = f"{settings.algorithm} cannot choose actions of {env.action_space}" if unfit else error
        raise SettingsError(f"{settings.algorithm} on {settings.env}: {reason}") from error


def _check_device(device: str) -> None:
    """Raises `SettingsError` unless torch can calculate on a device."""
    try:
        torch.zeros(1, device=device).item()
    except (RuntimeError, AssertionError, NotImplementedError) as error:  # torch raises any of these
        raise SettingsError(f"device {short_repr(device)} cannot be used: {one_line(error)}") from error


class LinearSchedule:
    """Linearly falling learning rate."""

    def __init__(self, first: float, last: float) -> None:
        self._first, self._last = first, last

    def __call__(self, remaining: float) -> float:
        """Returns the rate for a share of remaining steps."""
        return self._last + (self._first - self._last) * remaining


def save_model(model: Model, settings: TrainingSettings, folder: Path, seconds: float) -> None:
    """Writes a model with the state of its optimisers into a folder; an older model is replaced atomically.

    Replay buffers are not saved.

    Args:
        model: the model.
        settings: settings of the training.
        folder: folder of the two files.
        seconds: duration of the training [s].
    """
    parameters, tensors = parameters_of(model)
    page: Page = {
        "format": MODEL_FORMAT,
        "kind": KIND,
        "settings": settings.as_json(),
        "seconds": round(seconds, 2),
        **parameters,
    }
    folder.mkdir(parents=True, exist_ok=True)
    with replacing(folder / DESCRIPTION) as card, replacing(folder / TENSORS) as weights:
        save_tensors({name: value.detach().contiguous().clone() for name, value in tensors.items()}, weights)
        card.write_text(json.dumps(page, indent=1) + "\n", encoding="utf-8")


def parameters_of(model: Model) -> tuple[Page, dict[str, torch.Tensor]]:
    """Returns step counts and groups of the optimisers in JSON types, and all weights and optimiser states by name."""
    tensors: dict[str, torch.Tensor] = {}
    groups: dict[str, object] = {}
    for name, state in model.get_parameters().items():
        if "param_groups" in state:
            groups[name] = state["param_groups"]
            for index, values in state["state"].items():
                for key, value in values.items():
                    tensors[f"{name}/{index}/{key}"] = torch.as_tensor(value)
        else:
            tensors |= {f"{name}/{key}": value for key, value in state.items()}
    tensors |= {f"variables/{name}": value for name, value in _variables(model)}
    updates = int(getattr(model, "_n_updates", 0))
    return {"steps": int(model.num_timesteps), "updates": updates, "optimisers": groups}, tensors


def read_description(folder: Path) -> Page:
    """Returns the content of `model.json` in a folder.

    Raises:
        ModelFileError: the file is missing, damaged, or of another version.
    """
    path = folder / DESCRIPTION
    with raising(ModelFileError):
        try:
            page = read_json(path, MAX_MODEL_JSON)
        except FileNotFoundError:
            raise ModelFileError(f"{path}: does not exist; `dorothie-gym train-rl --out {folder}` makes one") from None
    if not isinstance(page, dict) or page.get("format") != MODEL_FORMAT:
        raise ModelFileError(f"{path}: format is not {MODEL_FORMAT}; the model is of another version of dorothie_gym")
    return page


def restore(model: Model, folder: Path) -> None:
    """Restores weights, optimisers and step count of a model from a folder.

    Raises:
        ModelFileError: the files are missing or damaged, or of a model with other layers.
    """
    page = read_description(folder)
    path = folder / TENSORS
    with _reading(path):
        tensors, _ = read_tensors(path)
        check_parameters(path, model, tensors)
    with refusing_misfits(path):
        set_parameters(model, page, tensors)


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turns errors of reading a file into `ModelFileError`."""
    with raising(ModelFileError):
        try:
            yield
        except OSError as error:
            raise ModelFileError(f"{path}: cannot be read ({error.strerror})") from None


def check_parameters(path: Path, model: Model, tensors: Mapping[str, torch.Tensor]) -> None:
    """Checks that tensors of a file are those that `parameters_of` returns for a model.

    Args:
        path: the file.
        model: model of the same settings.
        tensors: tensors by name.

    Raises:
        InputFileError: a tensor is missing, unknown, or has another shape or type; the message names it.
    """
    groups = {**model.get_parameters(), "variables": dict(_variables(model))}
    refuse_unknown(path, (name for name in tensors if name.split("/", 1)[0] not in groups))
    for group, state in groups.items():
        own, place = _tensors_under(f"{group}/", tensors), f"{group}/"
        if "param_groups" in state:
            optimiser = functools.reduce(getattr, group.split("."), model)
            rows = [parameter for each in optimiser.param_groups for parameter in each["params"]]
            check_optimiser(path, own, rows, place, "/")
        else:
            check_tensors(path, own, state, place)


@contextmanager
def refusing_misfits(path: Path) -> Iterator[None]:
    """Turns errors of restoring a model from a file into `ModelFileError`."""
    try:
        yield
    except ModelFileError:
        raise
    except (ValueError, RuntimeError, KeyError, TypeError, AttributeError, IndexError, OverflowError) as error:
        raise ModelFileError(f"{path}: does not fit the environment or the network ({one_line(error)})") from None


def set_parameters(model: Model, page: Page, tensors: Mapping[str, torch.Tensor]) -> None:
    """Sets the values returned by `parameters_of`; raises various errors if they do not match (`refusing_misfits`)."""
    variables = {name.split("/", 1)[1]: value for name, value in tensors.items() if name.startswith("variables/")}
    parameters = {
        name: _optimiser(name, page["optimisers"], tensors)
        if name in page["optimisers"]
        else _tensors_under(f"{name}/", tensors)
        for name in model.get_parameters()
    }
    model.set_parameters(parameters, exact_match=True, device="cpu")
    for name, value in _variables(model):
        value.data.copy_(variables[name])
    model.num_timesteps, model._n_updates = int(page["steps"]), int(page["updates"])


def load_model(folder: str | Path) -> tuple[Model, TrainingSettings]:
    """Returns a trained model and the settings of its training.

    Args:
        folder: folder of `train-rl`, or `model.json` or `model.safetensors` in it.

    Raises:
        ModelFileError: the files are missing or damaged.
        SettingsError: the environment that the model was trained in cannot be made.
    """
    folder = Path(folder)
    folder = folder.parent if folder.is_file() else folder
    settings = _read_settings(read_description(folder), folder)
    env = make_env_of_model(settings.env, settings.env_settings, folder)
    model = make_model(_for_playing(settings), env)
    restore(model, folder)
    return model, settings


def _read_settings(page: Page, folder: Path) -> TrainingSettings:
    """Returns the settings in `model.json`.

    Args:
        page: content of the file.
        folder: folder of the model.

    Raises:
        ModelFileError: a setting is missing, unknown, of another type or out of range, or requires a network that is
            larger than the weights in the folder; or these are missing or damaged.
    """
    with raising(ModelFileError):
        settings = checked(page.get("settings"), TrainingSettings, folder / DESCRIPTION)
    weights = folder / TENSORS
    with _reading(weights):
        stored = sum(math.prod(each.shape) for each in read_header(weights).tensors.values())
    wanted = sum(one * other for one, other in itertools.pairwise(settings.network))
    if wanted > stored:
        raise ModelFileError(
            f"{folder / DESCRIPTION}: field 'settings.network' is {list(settings.network)}, which asks for {wanted} "
            f"weights, and {TENSORS} has {stored}"
        )
    return settings


def _for_playing(settings: TrainingSettings) -> TrainingSettings:
    """Returns settings with the smallest buffers, for a model that does not learn."""
    parameters = dict(settings.parameters)
    smallest = {"n_steps": 2, "batch_size": 2} if settings.algorithm in ON_POLICY else {"buffer_size": 1}
    known = {name: value for name, value in smallest.items() if name in parameters or name == "buffer_size"}
    return replace(settings, parameters={**parameters, **known})


def _variables(model: Model) -> Iterator[tuple[str, torch.Tensor]]:
    """Yields tensors of an algorithm outside its networks (SAC: the logarithm of its temperature)."""
    for name in model._get_torch_save_params()[1]:
        value = getattr(model, name)
        if value is not None:
            yield name, value


def _tensors_under(prefix: str, tensors: Mapping[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Returns the tensors whose names begin with a prefix, without it."""
    return {name[len(prefix) :]: value for name, value in tensors.items() if name.startswith(prefix)}


def _optimiser(name: str, groups: Mapping[str, object], tensors: Mapping[str, torch.Tensor]) -> dict[str, object]:
    """Returns the state of an optimiser, as torch's `state_dict` has it."""
    state: dict[int, dict[str, torch.Tensor]] = {}
    for key, value in _tensors_under(f"{name}/", tensors).items():
        index, quantity = key.split("/")
        state.setdefault(int(index), {})[quantity] = value
    return {"state": state, "param_groups": groups[name]}
