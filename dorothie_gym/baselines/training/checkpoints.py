"""Models in files: safetensors, whole or not at all, with what made them. Nothing is ever unpickled."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor, nn

from dorothie_gym.errors import CheckpointError
from dorothie_gym.files import replacing

_MODEL: Final = "model."
_OPTIMISER: Final = "optimiser."
_ABOUT: Final = "dorothie_gym"


def save(
    path: Path, model: nn.Module, about: Mapping[str, Any], optimiser: torch.optim.Optimizer | None = None
) -> None:
    """Writes a model, and the state of its optimiser if given; whole or not at all.

    Args:
        path: file to write; its folder is made.
        model: its weights are written.
        about: what made it, in JSON types.
        optimiser: over the model's parameters in their order.

    Raises:
        OSError: the file cannot be written.
    """
    tensors = {_MODEL + name: value.detach().cpu().contiguous() for name, value in model.state_dict().items()}
    if optimiser is not None:
        for row, state in optimiser.state_dict()["state"].items():
            tensors |= {f"{_OPTIMISER}{row}.{name}": value.cpu().contiguous() for name, value in state.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path, shared=True) as part:
        save_file(tensors, part, metadata={_ABOUT: json.dumps(about, sort_keys=True)})


def about(path: Path) -> dict[str, Any]:
    """Returns what made a checkpoint.

    Raises:
        CheckpointError: the file is none of ours, or damaged.
    """
    try:
        with safe_open(path, framework="pt") as file:
            written = json.loads((file.metadata() or {})[_ABOUT])
    except (SafetensorError, KeyError, ValueError) as error:
        raise CheckpointError(f"{path}: is no checkpoint of this package, or damaged ({error}); delete it") from None
    if not isinstance(written, dict):
        raise CheckpointError(f"{path}: says nothing about itself; delete it")
    return written


def restore(path: Path, model: nn.Module, optimiser: torch.optim.Optimizer | None = None) -> None:
    """Reads the weights of a model, and the state of its optimiser if given.

    Raises:
        CheckpointError: the file is damaged, or of a model of other sizes.
    """
    try:
        with safe_open(path, framework="pt") as file:
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118  # a handle, not a dict
    except SafetensorError as error:
        raise CheckpointError(f"{path}: is damaged ({error}); delete it") from None
    weights = {name.removeprefix(_MODEL): value for name, value in tensors.items() if name.startswith(_MODEL)}
    try:
        model.load_state_dict(weights)
    except RuntimeError as error:
        message = f"{path}: is of a model of other sizes ({' '.join(str(error).split())[:200]}); delete it"
        raise CheckpointError(message) from None
    if optimiser is not None:
        _restore_optimiser(optimiser, tensors)


def _restore_optimiser(optimiser: torch.optim.Optimizer, tensors: Mapping[str, Tensor]) -> None:
    states: dict[int, dict[str, Tensor]] = {}
    for name, value in tensors.items():
        if name.startswith(_OPTIMISER):
            row, field = name.removeprefix(_OPTIMISER).split(".")
            states.setdefault(int(row), {})[field] = value
    optimiser.load_state_dict({"state": states, "param_groups": optimiser.state_dict()["param_groups"]})
