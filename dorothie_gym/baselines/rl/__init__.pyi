"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .checkpoint import load_model as load_model
from .evaluation import EpisodeStatistics as EpisodeStatistics
from .evaluation import evaluate_policy as evaluate_policy
from .run import TrainingResult as TrainingResult
from .settings import ALGORITHMS as ALGORITHMS
from .settings import TrainingSettings as TrainingSettings
from .settings import tuned_settings as tuned_settings
from .training import Training as Training
