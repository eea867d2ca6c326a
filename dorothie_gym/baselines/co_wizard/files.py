"""Files of the learned Co-Wizard, lessons and models: tensors in safetensors, everything else in JSON."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Final

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import load_file

from dorothie_gym.baselines.co_wizard.examples import UNKNOWN, Batch, Example, batch_of, forms_in
from dorothie_gym.baselines.co_wizard.network import CoWizardNetwork, Layout
from dorothie_gym.baselines.co_wizard.remarks import check_form
from dorothie_gym.baselines.tensor_files import save_tensors
from dorothie_gym.errors import InputFileError, ModelFileError, one_line
from dorothie_gym.files import replacing
from dorothie_gym.input_files import MAX_MODEL_JSON, MAX_WEIGHTS, check_file, checked, raising, read_json
from dorothie_gym.policies.policy_loader import DESCRIPTION

KIND: Final = "co-wizard"
"""Kind of the model in `model.json`; `policy_loader` selects the loader by it."""

TENSORS: Final = "model.safetensors"
MODEL_FORMAT: Final = 2
_FORMS: Final = "forms"


# --- Lessons ----------------------------------------------------------------------------------------------------------


def write_lessons(found: Sequence[Example], path: Path) -> None:
    """Writes the examples of a session, at least one, with the forms of their remarks."""
    forms = forms_in(found)
    batch = batch_of(found, forms)
    with replacing(path) as part:
        tensors = {one.name: getattr(batch, one.name).contiguous() for one in fields(batch)}
        save_tensors(tensors, part, {_FORMS: json.dumps(forms)})


def read_lessons(paths: Sequence[Path], vocabulary: Sequence[str]) -> Batch:
    """Returns the examples of some files, with their remarks numbered by a vocabulary; others are not learnt."""
    numbers = {form: k for k, form in enumerate(vocabulary)}
    batches = []
    for path in paths:
        tensors = load_file(path)
        known = torch.tensor([numbers.get(form, UNKNOWN) for form in forms_of(path)] + [UNKNOWN], dtype=torch.int16)
        for name in ("first", "second"):
            tensors[name] = known[tensors[name].long()]  # -1, the last one, stays unknown
        batches.append(Batch(**tensors))
    return Batch.joined(batches)


def forms_of(path: Path) -> list[str]:
    """Returns the forms of the remarks in a file of lessons."""
    with safe_open(path, framework="pt") as file:
        found: list[str] = json.loads(file.metadata()[_FORMS])
    return found


def vocabulary_of(paths: Sequence[Path], least: int) -> tuple[str, ...]:
    """Returns the forms that occur at least some number of times in files, the most frequent first, behind silence."""
    counts: Counter[str] = Counter()
    for path in paths:
        forms, tensors = forms_of(path), load_file(path)
        for name in ("first", "second"):
            counts.update(forms[number] for number in tensors[name].tolist() if number > 0)
    order = sorted(counts.items(), key=lambda pair: (-pair[1], pair[0]))
    return ("", *(form for form, count in order if count >= least))


# --- Model ------------------------------------------------------------------------------------------------------------


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


def save_network(network: CoWizardNetwork, page: ModelPage, folder: Path) -> None:
    """Writes a model into a folder, with weights in half precision; an older one stays whole until it is replaced."""
    folder.mkdir(parents=True, exist_ok=True)
    tensors = {name: value.detach().half().contiguous() for name, value in network.state_dict().items()}
    with replacing(folder / DESCRIPTION) as card, replacing(folder / TENSORS) as weights:
        save_tensors(tensors, weights)
        card.write_text(json.dumps(asdict(page), indent=1) + "\n", encoding="utf-8")


def load_network(folder: Path) -> tuple[CoWizardNetwork, ModelPage]:
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
    if page.layout != Layout.of(len(page.vocabulary)):
        raise ModelFileError(
            f"{card}: field 'layout' is that of another version of dorothie_gym; train the model again"
        )
    for number, form in enumerate(page.vocabulary[1:], start=1):
        try:
            check_form(form)
        except (ValueError, LookupError, TypeError, InputFileError) as error:
            raise ModelFileError(f"{card}: vocabulary[{number}] is no remark ({one_line(error)})") from None
    network = CoWizardNetwork(page.layout)
    try:
        check_file(weights, MAX_WEIGHTS)
        tensors = load_file(weights)
        network.load_state_dict(tensors)
    except (SafetensorError, OSError, InputFileError, RuntimeError) as error:
        raise ModelFileError(f"{weights}: cannot be read ({one_line(error)})") from None
    if any(not bool(value.isfinite().all()) for value in tensors.values()):
        raise ModelFileError(f"{weights}: has a weight that is no finite number")
    return network.eval(), page
