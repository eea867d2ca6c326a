"""Files of a learned role: weights in safetensors, everything else in JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Generic, TypeVar

from torch import nn

from dorothie_gym.baselines.tensor_files import check_tensors, read_tensors, save_tensors
from dorothie_gym.errors import InputFileError, ModelFileError, one_line
from dorothie_gym.policies.policy import DESCRIPTION
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


Network = TypeVar("Network", bound=nn.Module)


@dataclass(frozen=True, kw_only=True)
class ModelFiles(Generic[Network]):
    """Files of the models of a role.

    Attributes:
        kind: kind of the model; `policy_loader` selects the loader by it.
        version: `format` of the files.
        page: class of `model.json`, which has the field `layout`.
        layout: returns the layout of this version for a vocabulary of a given size.
        make: returns the network of a layout, with any weights.
        check_form: raises an error for a text that is not a form of a remark.
    """

    kind: str
    version: int
    page: type[RoleModelPage]
    layout: Callable[[int], Any]
    make: Callable[[Any], Network]
    check_form: Callable[[str], object]

    def network(self, remarks: int) -> Network:
        """Returns a network, with any weights, for a vocabulary of a given size."""
        return self.make(self.layout(remarks))

    def save(
        self,
        network: Network,
        folder: Path,
        *,
        vocabulary: Sequence[str],
        steps: int,
        seconds: float,
        settings: Mapping[str, object],
    ) -> None:
        """Writes a model into a folder, in half precision; an older one stays whole until it is replaced.

        Args:
            network: the network.
            folder: folder; it is made.
            vocabulary: forms of remarks, silence first.
            steps: number of examples times passes.
            seconds: processor time of the training [s].
            settings: settings of the training.
        """
        fields: dict[str, Any] = {"layout": self.layout(len(vocabulary)), "vocabulary": tuple(vocabulary)}
        page = self.page(format=self.version, kind=self.kind, steps=steps, seconds=seconds, settings=settings, **fields)
        folder.mkdir(parents=True, exist_ok=True)
        tensors = {name: one.detach().half().contiguous().clone() for name, one in network.state_dict().items()}
        with replacing(folder / DESCRIPTION) as card, replacing(folder / TENSORS) as weights:
            save_tensors(tensors, weights)
            card.write_text(json.dumps(asdict(page), indent=1) + "\n", encoding="utf-8")

    def load(self, folder: Path) -> tuple[Network, RoleModelPage]:
        """Reads a model from its folder, or from `model.json` in it.

        Raises:
            ModelFileError: a file is missing, damaged, or of another version.
        """
        folder = folder.parent if folder.is_file() else folder
        card, weights = folder / DESCRIPTION, folder / TENSORS
        page = self._read_page(card)
        network = self.network(len(page.vocabulary))
        with raising(ModelFileError):
            try:
                tensors, _ = read_tensors(weights)
            except OSError as error:
                raise ModelFileError(f"{weights}: cannot be read ({error.strerror})") from None
            check_tensors(weights, tensors, network.state_dict())
        network.load_state_dict(tensors)
        return network.eval(), page

    def _read_page(self, card: Path) -> RoleModelPage:
        """Returns the content of `model.json`, all of which is that of this version."""
        with raising(ModelFileError):
            try:
                page = checked(read_json(card, MAX_MODEL_JSON), self.page, card)
            except OSError as error:
                raise ModelFileError(f"{card}: cannot be read ({error.strerror})") from None
        if page.format != self.version or page.kind != self.kind:
            raise ModelFileError(
                f"{card}: is no {self.kind} of format {self.version}; it is of another version of dorothie_gym"
            )
        if page.vocabulary[:1] != ("",) or getattr(page, "layout", None) != self.layout(len(page.vocabulary)):
            raise ModelFileError(
                f"{card}: field 'layout' is that of another version of dorothie_gym; train the model again"
            )
        for number, form in enumerate(page.vocabulary[1:], start=1):
            try:
                self.check_form(form)
            except (ValueError, LookupError, TypeError, AttributeError, StopIteration, InputFileError) as error:
                raise ModelFileError(f"{card}: vocabulary[{number}] is no remark ({one_line(error)})") from None
        return page
