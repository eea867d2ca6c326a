"""Training of models, and what is kept of it."""

from dorothie_gym.baselines.training.trainer import (
    BEST_FILE,
    LAST_FILE,
    Epoch,
    Model,
    Schedule,
    Trained,
    batches,
    device,
    predict,
    train,
)
from dorothie_gym.errors import CheckpointError

__all__ = [
    "BEST_FILE",
    "CheckpointError",
    "Epoch",
    "LAST_FILE",
    "Model",
    "Schedule",
    "Trained",
    "batches",
    "device",
    "predict",
    "train",
]
