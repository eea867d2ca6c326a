"""Reinforcement learning with stable-baselines3: training, evaluation, and weights that are no pickles."""

from dorothie_gym.baselines.rl.evaluating import Outcome, evaluate_policy
from dorothie_gym.baselines.rl.settings import ALGORITHMS, SettingsError, TrainingSettings, tuned_settings
from dorothie_gym.baselines.rl.training import Run, Training
from dorothie_gym.baselines.rl.weights import WeightsError, load_model

__all__ = [
    "ALGORITHMS",
    "Outcome",
    "Run",
    "SettingsError",
    "Training",
    "TrainingSettings",
    "WeightsError",
    "evaluate_policy",
    "load_model",
    "tuned_settings",
]
