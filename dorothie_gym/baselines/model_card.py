"""Model card of a trained benchmark model, in `model.json` beside its weights."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Self

from dorothie_gym.files import write_atomically
from dorothie_gym.policies.policy_loader import DESCRIPTION

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
        weights_sha256: its SHA-256; a hash of this file thereby covers the weights.
        steps: points of an epoch times the number of epochs.
        seconds: duration of the training [s].
    """

    row: str
    config: Mapping[str, Any]
    corpus: str
    encoder: str
    encoder_id: str
    spread: float | None
    merges: tuple[tuple[int, int], ...] | None
    weights: str
    weights_sha256: str
    steps: int
    seconds: float

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
            ValueError: the file cannot be read, or is of another version; the message names it.
        """
        file = path / DESCRIPTION if path.is_dir() else path
        try:
            page = json.loads(file.read_text(encoding="utf-8"))
            merges = page.pop("merges")
            page.pop("kind")
            return cls(**page, merges=None if merges is None else tuple((one, other) for one, other in merges))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ValueError(f"{file}: describes no model of this version ({error}); train it again") from None


def sha256_of(path: Path) -> str:
    """Returns the SHA-256 of a file in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
