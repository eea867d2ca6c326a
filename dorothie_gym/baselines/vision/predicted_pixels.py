"""Classes and depths that a SegFormer predicts for pictures, computed once and stored next to its weights."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.baselines.vision.frames import FrameSet, SessionFrames
from dorothie_gym.baselines.vision.pixel_learner import predict_pixels
from dorothie_gym.support.files import replacing

if TYPE_CHECKING:
    from dorothie_gym.baselines.vision.segformer import SegFormer

_AT_ONCE: Final = 8  # pictures


def with_predictions(
    pictures: FrameSet, model: SegFormer, folder: Path, on_session: Callable[[], None] = lambda: None
) -> FrameSet:
    """Returns pictures whose classes and depths are those that a model predicts; boxes stay true.

    Args:
        pictures: the pictures.
        model: trained model.
        folder: for the predictions of this model only; stored predictions are read.
        on_session: called after each session.

    Raises:
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    model.eval()
    found = []
    for session in pictures.sessions:
        found.append(_predicted(session, model, folder))
        on_session()
    return FrameSet(found)


def _predicted(session: SessionFrames, model: SegFormer, folder: Path) -> SessionFrames:
    kept = {part: folder / f"{session.key}-{part}.npy" for part in ("semantic", "depth")}
    if not all(path.is_file() for path in kept.values()):
        semantic, depth = np.empty_like(session.semantic), np.empty_like(session.depth)
        for start in range(0, len(session), _AT_ONCE):
            rows = slice(start, start + _AT_ONCE)
            semantic[rows], depth[rows] = predict_pixels(
                model, np.array(session.rgb[rows])
            )  # torch warns of maps that are read only
        for part, values in (("semantic", semantic), ("depth", depth)):
            with replacing(kept[part], shared=True) as path, path.open("wb") as file:
                np.save(file, values, allow_pickle=False)
    arrays = {
        part: np.load(path, mmap_mode="r" if len(session) else None, allow_pickle=False) for part, path in kept.items()
    }
    return dataclasses.replace(session, **arrays)
