"""Files of a learned role: weights in safetensors, everything else in JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, TypeVar

import torch
from torch import nn

from dorothie_gym.baselines.tensor_files import check_tensors, read_tensors, save_tensors
from dorothie_gym.errors import InputFileError, ModelFileError, one_line
from dorothie_gym.policies.policy_loader import DESCRIPTION
from dorothie_gym.support.files import replacing
from dorothie_gym.support.input_files import MAX_MODEL_JSON, checked, raising, read_json

TENSORS: Final = "model.safetensors"


@dataclass(frozen=True, kw_only=True)
class RoleModelPage:
    """Content of `model.json`, to which a role adds the layout of its network.

    Attributes:
        format: version of the files.
        kind: kind of the model; `policy_loader` selects the loader by it.
        vocabulary: forms of remarks, silence first.
        steps: number of examples times passes.
        seconds: processor time of the training [s].
        settings: settings of the training.
    """

    format: int
    kind: str
    vocabulary: tuple[str, ...]
    steps: int
    seconds: float
    settings: Mapping[str, object]


Page = TypeVar("Page", bound=RoleModelPage)
Network = TypeVar("Network", bound=nn.Module)


def save_model(network: nn.Module, page: RoleModelPage, folder: Path, dtype: torch.dtype = torch.float32) -> None:
    """Writes a model into a folder; an older one stays whole until it is replaced.

    Args:
        network: the network.
        page: content of `model.json`.
        folder: folder; it is made.
        dtype: type of the weights in the file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tensors = {name: value.detach().to(dtype).contiguous().clone() for name, value in network.state_dict().items()}
    with replacing(folder / DESCRIPTION) as card, replacing(folder / TENSORS) as weights:
        save_tensors(tensors, weights)
        card.write_text(json.dumps(asdict(page), indent=1) + "\n", encoding="utf-8")


def load_model(
    folder: Path,
    page_type: type[Page],
    kind: str,
    version: int,
    *,
    make: Callable[[Page], Network | None],
    check_form: Callable[[str], object],
) -> tuple[Network, Page]:
    """Reads a model.

    Args:
        folder: folder of the model, or `model.json` in it.
        page_type: class of its page.
        kind: kind that the page must have.
        version: `format` that it must have.
        make: returns the network of a page, with any weights; None if its layout is that of another version.
        check_form: raises an error for a text that is no form of a remark.

    Raises:
        ModelFileError: a file is missing, damaged, or of another version.
    """
    folder = folder.parent if folder.is_file() else folder
    card, weights = folder / DESCRIPTION, folder / TENSORS
    with raising(ModelFileError):
        try:
            page = checked(read_json(card, MAX_MODEL_JSON), page_type, card)
        except OSError as error:
            raise ModelFileError(f"{card}: cannot be read ({error.strerror})") from None
    if page.format != version or page.kind != kind:
        raise ModelFileError(f"{card}: is no {kind} of format {version}; it is of another version of dorothie_gym")
    network = make(page) if page.vocabulary[:1] == ("",) else None
    if network is None:
        raise ModelFileError(
            f"{card}: field 'layout' is that of another version of dorothie_gym; train the model again"
        )
    for number, form in enumerate(page.vocabulary[1:], start=1):
        try:
            check_form(form)
        except (ValueError, LookupError, TypeError, AttributeError, StopIteration, InputFileError) as error:
            raise ModelFileError(f"{card}: vocabulary[{number}] is no remark ({one_line(error)})") from None
    with raising(ModelFileError):
        try:
            tensors, _ = read_tensors(weights)
        except OSError as error:
            raise ModelFileError(f"{weights}: cannot be read ({error.strerror})") from None
        check_tensors(weights, tensors, network.state_dict())
    network.load_state_dict(tensors)
    return network.eval(), page
