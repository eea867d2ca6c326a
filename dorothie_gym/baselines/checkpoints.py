"""Files of trained models: weights and optimiser state (safetensors), and the model card."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Self

import torch
from torch import Tensor, nn

from dorothie_gym.baselines.tensor_files import (
    check_optimiser,
    check_tensors,
    read_header,
    read_tensors,
    refuse_unknown,
    save_tensors,
)
from dorothie_gym.errors import CheckpointError, InputFileError, ModelFileError, one_line, short_repr
from dorothie_gym.policies.policy import DESCRIPTION
from dorothie_gym.support.files import replacing, write_atomically
from dorothie_gym.support.input_files import MAX_MODEL_JSON, checked, parse_json, raising, read_json

_MODEL: Final = "model."
_OPTIMISER: Final = "optimiser."
_ABOUT: Final = "dorothie_gym"


def save(
    path: Path, model: nn.Module, about: Mapping[str, object], optimiser: torch.optim.Optimizer | None = None
) -> None:
    """Writes a model, and the state of its optimiser if given, atomically.

    Args:
        path: file to write; its folder is created.
        model: model whose weights are written.
        about: metadata in JSON types.
        optimiser: optimiser over the model's parameters in their order.

    Raises:
        OSError: the file cannot be written.
    """
    tensors = {_MODEL + name: value.detach().cpu().contiguous() for name, value in model.state_dict().items()}
    if optimiser is not None:
        for row, state in optimiser.state_dict()["state"].items():
            tensors |= {f"{_OPTIMISER}{row}.{name}": value.cpu().contiguous() for name, value in state.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path, shared=True) as part:
        save_tensors(tensors, part, {_ABOUT: json.dumps(about, sort_keys=True)})


def about(path: Path) -> dict[str, Any]:
    """Returns the metadata of a checkpoint.

    Raises:
        CheckpointError: the file is not a checkpoint of this package, or is damaged.
    """
    try:
        written = parse_json(read_header(path).metadata.get(_ABOUT, ""), path)
    except InputFileError as error:
        raise CheckpointError(f"{error}; it is no checkpoint of this package, or damaged, delete it") from None
    if not isinstance(written, dict):
        raise CheckpointError(f"{path}: its metadata is no JSON object; delete it")
    return written


def restore(path: Path, model: nn.Module, optimiser: torch.optim.Optimizer | None = None) -> None:
    """Reads the weights of a model, and the state of its optimiser if given.

    Raises:
        CheckpointError: the file is damaged, or of a model of other sizes.
    """
    with raising(lambda message: CheckpointError(f"{message}; the file is damaged, delete it")):
        tensors, _ = read_tensors(path)
    misfit = "the file is damaged or was written by a model of other sizes, delete it"
    with raising(lambda message: CheckpointError(f"{message}; {misfit}")):
        refuse_unknown(path, (name for name in tensors if not name.startswith((_MODEL, _OPTIMISER))))
        weights = _under(_MODEL, tensors)
        check_tensors(path, weights, model.state_dict(), _MODEL)
        states = _under(_OPTIMISER, tensors)
        if optimiser is not None:
            rows = [parameter for group in optimiser.param_groups for parameter in group["params"]]
            check_optimiser(path, states, rows, _OPTIMISER, ".")
    model.load_state_dict(weights)
    if optimiser is not None:
        _restore_optimiser(optimiser, states, path)


def _under(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {name.removeprefix(prefix): value for name, value in tensors.items() if name.startswith(prefix)}


def _restore_optimiser(optimiser: torch.optim.Optimizer, tensors: Mapping[str, Tensor], path: Path) -> None:
    states: dict[int, dict[str, Tensor]] = {}
    for name, value in tensors.items():
        row, quantity = name.split(".")
        states.setdefault(int(row), {})[quantity] = value
    try:
        optimiser.load_state_dict({"state": states, "param_groups": optimiser.state_dict()["param_groups"]})
    except (ValueError, KeyError, RuntimeError) as error:
        raise CheckpointError(f"{path}: its optimiser is damaged ({one_line(error)}); delete it") from None


# --- Model card of a trained benchmark model, in `model.json` beside its weights -------------------------------------

KIND: Final = "benchmark"
"""Kind of these files in `policy_loader`."""


@dataclass(frozen=True, kw_only=True)
class ModelCard:
    """Content of a `model.json`.

    Attributes:
        row: command of the model in the table.
        config: fields of its `TOTOConfig`.
        corpus: hash of the corpus.
        encoder: name of the text encoder.
        encoder_id: its id: equal ids, equal vectors.
        spread: divisor of the vectors of texts; None if the model's text encoder is trained.
        merges: byte pairs learned from the training sessions; None if the model uses none.
        weights: name of the file with the weights, in the same folder.
        weights_sha256: its SHA-256; a hash of this file thus covers the weights.
        steps: points of an epoch times the number of epochs.
        seconds: duration of the training [s].
    """

    row: str
    config: Mapping[str, object]
    corpus: str
    encoder: str
    encoder_id: str
    spread: float | None
    merges: tuple[tuple[int, int], ...] | None
    weights: str
    weights_sha256: str
    steps: int
    seconds: float

    def __post_init__(self) -> None:
        """Checks conditions that the types do not express."""
        if Path(self.weights).name != self.weights:
            raise ValueError(f"weights is {short_repr(self.weights)}; it must be the name of a file in the folder")
        if self.spread is not None and not 0.0 < self.spread < math.inf:
            raise ValueError(f"spread is {self.spread}; it must be positive")
        if self.steps < 0 or not 0.0 <= self.seconds < math.inf:
            raise ValueError(f"steps and seconds are {self.steps} and {self.seconds}; they must be at least 0")

    def write(self, folder: Path) -> None:
        """Writes the card into the folder of the weights, atomically."""
        page = {"kind": KIND, **asdict(self)}
        write_atomically(folder / DESCRIPTION, json.dumps(page) + "\n")

    @classmethod
    def read(cls, path: Path) -> Self:
        """Reads a card.

        Args:
            path: the file, or its folder.

        Raises:
            ModelFileError: the file cannot be read, or is of another version; the message names it.
        """
        file = path / DESCRIPTION if path.is_dir() else path
        try:
            page = read_json(file, MAX_MODEL_JSON)
            fields = {name: value for name, value in page.items() if name != "kind"} if isinstance(page, dict) else page
            card = checked(fields, cls, file)
        except (OSError, InputFileError) as error:
            raise ModelFileError(
                f"{file}: describes no model of this version ({one_line(error)}); train it again"
            ) from None
        return card


def sha256_of(path: Path) -> str:
    """Returns the SHA-256 of a file in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
