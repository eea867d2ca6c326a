"""Folds of a corpus, named by the folders of its sessions."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Final

from dorothie_gym.errors import SessionError


class Fold(enum.StrEnum):
    """Fold of a corpus; its value is the folder. Towns of the unseen folds do not occur in training (paper)."""

    TRAIN = "train"
    VAL_SEEN = "val/seen"
    VAL_UNSEEN = "val/unseen"
    TEST_SEEN = "test/seen"
    TEST_UNSEEN = "test/unseen"
    VAL = "val"
    TEST = "test"

    def matches(self, wanted: str) -> bool:
        """Returns whether the fold is `wanted` or one of its parts: "val" and "seen" have two each."""
        return wanted == self.value or wanted in self.value.split("/")


SPLITS: Final = ("train", "val", "test")
TOWNS: Final = ("seen", "unseen")

FOLDS: Final = (Fold.TRAIN, Fold.VAL_SEEN, Fold.VAL_UNSEEN, Fold.TEST_SEEN, Fold.TEST_UNSEEN)
"""The folds of the paper's table."""


def fold_of_folder(folder: Path) -> Fold | None:
    """Returns the fold of a session's folder; None outside of folds."""
    parts = folder.absolute().parts[-3:-1]
    if len(parts) == 2 and parts[0] in SPLITS and parts[1] in TOWNS:
        name = "/".join(parts)
    else:
        name = parts[-1] if parts else ""
    return next((fold for fold in Fold if fold.value == name), None)


def check_fold(wanted: str) -> str:
    """Returns the name of a fold or of a group of folds ("val", "seen"); raises `SessionError` for other names."""
    known = sorted({part for fold in Fold for part in (fold.value, *fold.value.split("/"))})
    if str(wanted) not in known:
        raise SessionError(f"fold: {str(wanted)!r} is unknown; choose from {', '.join(known)}")
    return str(wanted)
