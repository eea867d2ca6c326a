"""Reinforcement learning with stable-baselines3: training, evaluation, and checkpoints without pickles."""

from dorothie_gym.baselines.rl.checkpoint import load_model
from dorothie_gym.baselines.rl.evaluation import EpisodeStatistics, evaluate_policy
from dorothie_gym.baselines.rl.run import TrainingResult
from dorothie_gym.baselines.rl.settings import ALGORITHMS, TrainingSettings, tuned_settings
from dorothie_gym.baselines.rl.training import Training
from dorothie_gym.errors import ModelFileError, SettingsError

__all__ = [
    "ALGORITHMS",
    "EpisodeStatistics",
    "ModelFileError",
    "SettingsError",
    "Training",
    "TrainingResult",
    "TrainingSettings",
    "evaluate_policy",
    "load_model",
    "tuned_settings",
]
