"""Training of models, and what is kept of it."""

from dorothie_gym.baselines.training.trainer import (
    BEST_FILE,
    LAST_FILE,
    Epoch,
    Model,
    Schedule,
    TrainingSummary,
    batches,
    device,
    predict,
    train,
)
from dorothie_gym.errors import CheckpointError

__all__ = [
    "BEST_FILE",
    "LAST_FILE",
    "CheckpointError",
    "Epoch",
    "Model",
    "Schedule",
    "TrainingSummary",
    "batches",
    "device",
    "predict",
    "train",
]
