"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .checkpoint import load_model as load_model
from .environments import has_batch as has_batch
from .evaluation import EpisodeStatistics as EpisodeStatistics
from .evaluation import evaluate_policy as evaluate_policy
from .run import BEST as BEST
from .run import CURVE as CURVE
from .run import OnProgress as OnProgress
from .run import OnStage as OnStage
from .run import TrainingEvaluation as TrainingEvaluation
from .run import TrainingResult as TrainingResult
from .settings import ALGORITHMS as ALGORITHMS
from .settings import TrainingSettings as TrainingSettings
from .settings import tuned_settings as tuned_settings
from .training import Training as Training
from .training import best_of as best_of
