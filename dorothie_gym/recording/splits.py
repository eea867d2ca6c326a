"""Folds of a corpus, by the folders that its sessions lie in."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Final

from dorothie_gym.errors import SessionError


class Fold(enum.StrEnum):
    """A fold; its value is the folder (paper: towns of the unseen folds do not occur in training)."""

    TRAIN = "train"
    VAL_SEEN = "val/seen"
    VAL_UNSEEN = "val/unseen"
    TEST_SEEN = "test/seen"
    TEST_UNSEEN = "test/unseen"
    VAL = "val"
    TEST = "test"

    def matches(self, wanted: str) -> bool:
        """Whether the fold is `wanted`, or a part of it: "val" has two, so has "seen"."""
        return wanted == self.value or wanted in self.value.split("/")


SPLITS: Final = ("train", "val", "test")
TOWNS: Final = ("seen", "unseen")

FOLDS: Final = (Fold.TRAIN, Fold.VAL_SEEN, Fold.VAL_UNSEEN, Fold.TEST_SEEN, Fold.TEST_UNSEEN)
"""The folds of the paper's table."""


def fold_of_folder(folder: Path) -> Fold | None:
    """Returns the fold that the folder of a session lies in; None where it lies in none."""
    parts = folder.absolute().parts[-3:-1]
    if len(parts) == 2 and parts[0] in SPLITS and parts[1] in TOWNS:
        name = "/".join(parts)
    else:
        name = parts[-1] if parts else ""
    return next((fold for fold in Fold if fold.value == name), None)


def check_fold(wanted: str) -> str:
    """Returns the name of a fold or of several ("val", "seen"); raises `SessionError` for others."""
    known = sorted({part for fold in Fold for part in (fold.value, *fold.value.split("/"))})
    if str(wanted) not in known:
        raise SessionError(f"fold: {str(wanted)!r} is unknown; choose from {', '.join(known)}")
    return str(wanted)
