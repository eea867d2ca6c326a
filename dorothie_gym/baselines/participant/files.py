"""Files of a learned participant: weights in safetensors, everything else in JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from safetensors import SafetensorError
from safetensors.torch import load_file

from dorothie_gym.baselines.participant.network import Layout, ParticipantNetwork
from dorothie_gym.baselines.participant.remarks import check_form
from dorothie_gym.baselines.tensor_files import save_tensors
from dorothie_gym.errors import InputFileError, ModelFileError, one_line
from dorothie_gym.files import replacing
from dorothie_gym.input_files import MAX_MODEL_JSON, MAX_WEIGHTS, check_file, checked, raising, read_json
from dorothie_gym.policies.policy_loader import DESCRIPTION

KIND: Final = "participant"
"""Kind of the model in `model.json`; `policy_loader` selects the loader by it."""

TENSORS: Final = "model.safetensors"
MODEL_FORMAT: Final = 1


@dataclass(frozen=True, kw_only=True)
class ModelPage:
    """Content of `model.json`.

    Attributes:
        format: version of the files.
        kind: `KIND`.
        layout: lengths of inputs and outputs.
        vocabulary: forms of remarks, silence first.
        steps: number of examples times passes.
        seconds: processor time of the training [s].
        settings: settings of the training.
    """

    format: int
    kind: str
    layout: Layout
    vocabulary: tuple[str, ...]
    steps: int
    seconds: float
    settings: Mapping[str, object]


def save_network(network: ParticipantNetwork, page: ModelPage, folder: Path) -> None:
    """Writes a model into a folder; an older one stays whole until it is replaced."""
    folder.mkdir(parents=True, exist_ok=True)
    tensors = {name: value.detach().contiguous().clone() for name, value in network.state_dict().items()}
    with replacing(folder / DESCRIPTION) as card, replacing(folder / TENSORS) as weights:
        save_tensors(tensors, weights)
        card.write_text(json.dumps(asdict(page), indent=1) + "\n", encoding="utf-8")


def load_network(folder: Path) -> tuple[ParticipantNetwork, ModelPage]:
    """Reads a model.

    Args:
        folder: folder of the model, or `model.json` in it.

    Raises:
        ModelFileError: a file is missing, damaged, or of another version.
    """
    folder = folder.parent if folder.is_file() else folder
    card, weights = folder / DESCRIPTION, folder / TENSORS
    with raising(ModelFileError):
        try:
            page = checked(read_json(card, MAX_MODEL_JSON), ModelPage, card)
        except OSError as error:
            raise ModelFileError(f"{card}: cannot be read ({error.strerror})") from None
    if page.format != MODEL_FORMAT or page.kind != KIND:
        raise ModelFileError(f"{card}: is no {KIND} of format {MODEL_FORMAT}; it is of another version of dorothie_gym")
    if page.layout != Layout.of(len(page.vocabulary)) or page.vocabulary[:1] != ("",):
        raise ModelFileError(
            f"{card}: field 'layout' is that of another version of dorothie_gym; train the model again"
        )
    for number, form in enumerate(page.vocabulary[1:], start=1):
        try:
            check_form(form)
        except (ValueError, LookupError, TypeError, AttributeError, InputFileError) as error:
            raise ModelFileError(f"{card}: vocabulary[{number}] is no remark ({one_line(error)})") from None
    network = ParticipantNetwork(page.layout)
    try:
        check_file(weights, MAX_WEIGHTS)
        tensors = load_file(weights)
        network.load_state_dict(tensors)
    except (SafetensorError, OSError, InputFileError, RuntimeError) as error:
        raise ModelFileError(f"{weights}: cannot be read ({one_line(error)})") from None
    if any(not bool(value.isfinite().all()) for value in tensors.values()):
        raise ModelFileError(f"{weights}: has a weight that is no finite number")
    return network.eval(), page
