"""Files of the learned Co-Wizard, lessons and models: tensors in safetensors, everything else in JSON."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

import torch
from safetensors import safe_open
from safetensors.torch import load_file

from dorothie_gym.baselines.co_wizard.examples import UNKNOWN, Batch, Example, batch_of, forms_in
from dorothie_gym.baselines.co_wizard.network import CoWizardNetwork, Layout
from dorothie_gym.baselines.co_wizard.remarks import check_form
from dorothie_gym.baselines.imitation.model_files import RoleModelPage, load_model, save_model
from dorothie_gym.baselines.tensor_files import save_tensors
from dorothie_gym.files import replacing

KIND: Final = "co-wizard"
"""Kind of the model in `model.json`; `policy_loader` selects the loader by it."""

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
class ModelPage(RoleModelPage):
    """Content of `model.json`.

    Attributes:
        layout: lengths of inputs and outputs.
    """

    layout: Layout


def save_network(
    network: CoWizardNetwork, page: ModelPage, folder: Path, dtype: torch.dtype = torch.float16
) -> None:  # fmt: skip
    """Writes a model into a folder; an older one stays whole until it is replaced. See `save_model`."""
    save_model(network, page, folder, dtype)


def load_network(folder: Path) -> tuple[CoWizardNetwork, ModelPage]:
    """Reads a model from its folder, or from `model.json` in it.

    Raises:
        ModelFileError: a file is missing, damaged, or of another version.
    """
    return load_model(folder, ModelPage, KIND, MODEL_FORMAT, make=_network, check_form=check_form)


def _network(page: ModelPage) -> CoWizardNetwork | None:
    return CoWizardNetwork(page.layout) if page.layout == Layout.of(len(page.vocabulary)) else None
