"""Examples as tensors, and the files with the examples of a session."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar, Final, Generic, Self, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray

from dorothie_gym.baselines.tensor_files import read_tensors, refuse_unknown, save_tensors, tensor_name
from dorothie_gym.errors import CheckpointError, InputFileError
from dorothie_gym.support.files import replacing
from dorothie_gym.support.input_files import checked, parse_json, raising

UNKNOWN: Final = -1
"""Target value for outputs that an example does not train."""

IDLE_SHARE: Final = 0.25
"""Share of idle decisions that is kept; each is weighted by the inverse of this share."""

_FORMS: Final = "forms"
Example = TypeVar("Example")


@dataclass(frozen=True, eq=False)
class ExampleBatch(ABC, Generic[Example]):
    """Examples as tensors; the first axis of each is that of the examples.

    Attributes:
        REMARKS: names of the tensors that number remarks; 0 is silence.
    """

    REMARKS: ClassVar[tuple[str, ...]] = ()

    def __len__(self) -> int:
        """Returns the number of examples."""
        first: torch.Tensor = getattr(self, fields(self)[0].name)
        return len(first)

    def rows(self, index: torch.Tensor) -> Self:
        """Returns the examples at the given positions."""
        return type(self)(**{one.name: getattr(self, one.name)[index] for one in fields(self)})

    @classmethod
    @abstractmethod
    def of(cls, found: Sequence[Example], forms: Sequence[str]) -> Self:
        """Returns examples as tensors.

        Args:
            found: the examples, at least one.
            forms: forms of remarks that are numbered; others are not learnt. The first one, "", stands for silence.
        """

    @classmethod
    def joined(cls, batches: Sequence[Self]) -> Self:
        """Returns all examples of the given batches."""
        found: dict[str, Any] = {}
        for one in fields(cls):
            found[one.name] = torch.cat([getattr(batch, one.name) for batch in batches])
        return cls(**found)

    def write(self, path: Path, forms: Sequence[str]) -> None:
        """Writes the examples with the forms of their remarks."""
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            tensors = {one.name: getattr(self, one.name).contiguous() for one in fields(self)}
            save_tensors(tensors, part, {_FORMS: json.dumps(list(forms))})

    @classmethod
    def read(cls, paths: Sequence[Path], vocabulary: Sequence[str]) -> Self:
        """Returns the examples of the given files, with their remarks numbered by a vocabulary; others are not trained.

        Raises:
            CheckpointError: a file is damaged.
        """
        numbers = {form: k for k, form in enumerate(vocabulary)}
        batches = []
        for path in paths:
            tensors, forms = cls._stored(path)
            known = torch.tensor([numbers.get(form, UNKNOWN) for form in forms] + [UNKNOWN], dtype=torch.int16)
            for name in cls.REMARKS:
                tensors[name] = known[tensors[name].long()]  # -1, the last one, stays unknown
            batches.append(cls(**tensors))
        return cls.joined(batches)

    @classmethod
    def _stored(cls, path: Path) -> tuple[dict[str, torch.Tensor], list[str]]:
        """Returns the tensors of a file, and the forms of its remarks."""
        with raising(lambda message: CheckpointError(f"{message}; delete it")):
            tensors, metadata = read_tensors(path)
            forms = checked(parse_json(metadata.get(_FORMS, ""), path), list[str], path)
            names = {one.name for one in fields(cls)}
            refuse_unknown(path, (name for name in tensors if name not in names))
            if missing := sorted(names - set(tensors)):
                raise InputFileError(path, "is missing", tensor_name(missing[0]))
        return tensors, forms

    @classmethod
    def vocabulary_of(cls, paths: Sequence[Path], least: int) -> tuple[str, ...]:
        """Returns the forms that occur in files at least a given number of times: silence, then by falling frequency.

        Args:
            paths: files.
            least: minimum number of occurrences.
        """
        counts: Counter[str] = Counter()
        for path in paths:
            tensors, forms = cls._stored(path)
            for name in cls.REMARKS:
                counts.update(forms[number] for number in tensors[name].flatten().tolist() if number > 0)
        order = sorted(counts.items(), key=lambda pair: (-pair[1], pair[0]))
        return ("", *(form for form, count in order if count >= least))


def reals(vectors: Sequence[NDArray[np.float32]]) -> torch.Tensor:
    """Returns vectors (n, ...) as half-precision numbers: inputs are coarse, and there are many."""
    return torch.from_numpy(np.stack(vectors).astype(np.float16))


def whole(numbers: Sequence[object]) -> torch.Tensor:
    """Returns integers, or rows of them, as a tensor of 16 bits."""
    return torch.tensor(numbers, dtype=torch.int16)


def form_numbers(remarks: Sequence[Sequence[str | None]], forms: Sequence[str]) -> torch.Tensor:
    """Returns the numbers of the forms of remarks (n, k); `UNKNOWN` for those that are not learnt."""
    numbers = {form: k for k, form in enumerate(forms)}
    return whole([[UNKNOWN if form is None else numbers.get(form, UNKNOWN) for form in row] for row in remarks])


def weights_of(weights: Sequence[float]) -> torch.Tensor:
    """Returns the weights of examples (n,)."""
    return torch.tensor(weights, dtype=torch.float32)


def word_tensor(rows: Sequence[NDArray[np.int64]]) -> torch.Tensor:
    """Returns the rows of words (n, w)."""
    return torch.from_numpy(np.stack(rows).astype(np.int16))


def forms_in(remarks: Iterable[str | None]) -> tuple[str, ...]:
    """Returns the distinct forms of remarks: silence first, then the others in sorted order."""
    return ("", *sorted({form for form in remarks if form}))
