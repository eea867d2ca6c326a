"""Training of models, and what is kept of it."""

from dorothie_gym.baselines.training.checkpoints import CheckpointError
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
