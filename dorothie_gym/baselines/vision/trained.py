"""Trained vision models, read from their folders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch

from dorothie_gym.baselines import checkpoints
from dorothie_gym.baselines.trainer import BEST_FILE
from dorothie_gym.baselines.vision.detector import Detector, DetectorConfig
from dorothie_gym.baselines.vision.segformer import SegFormer, SegFormerConfig
from dorothie_gym.errors import CheckpointError
from dorothie_gym.support.input_files import checked, raising


def load_segformer(folder: Path, device: torch.device) -> SegFormer:
    """Returns a trained SegFormer.

    Raises:
        CheckpointError: the folder holds none.
    """
    model = SegFormer(stored_config(folder, SegFormerConfig))
    checkpoints.restore(folder / BEST_FILE, model)
    return model.to(device).eval()


def load_detector(folder: Path, device: torch.device) -> Detector:
    """Returns a trained Deformable DETR.

    Raises:
        CheckpointError: the folder holds none.
    """
    model = Detector(stored_config(folder, DetectorConfig))
    checkpoints.restore(folder / BEST_FILE, model)
    return model.to(device).eval()


def stored_config(folder: Path, kind: Any) -> Any:
    """Returns the config of a trained model, of the class `kind`; errors as in `load_detector`."""
    path = folder / BEST_FILE
    if not path.is_file():
        name = "segformer" if kind is SegFormerConfig else "detr"
        raise CheckpointError(f"{path}: is missing; run first: dorothie-gym train {name} with the same --out")
    with raising(lambda message: CheckpointError(f"{message}; delete it")):
        return checked(checkpoints.about(path).get("config"), kind, path)
