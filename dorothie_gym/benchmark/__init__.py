"""The three tasks on recordings: metrics, prediction files, trivial baselines and the results table."""

from dorothie_gym.analysis.intervals import Estimate
from dorothie_gym.benchmark.claims import ModelClaim, ModelFinding, ModelVerdict, above, findings
from dorothie_gym.benchmark.labels import SPLITS, CorpusLabels, Split, TaskLabels, Unscored, labels_of
from dorothie_gym.benchmark.metrics import (
    COLUMNS,
    ActionAccuracy,
    ArgumentAccuracy,
    ArgumentAccuracyPaper,
    JointAccuracy,
    JointAccuracyPaper,
    Metric,
    MoveAccuracy,
    SlotF1,
    SlotScorePaper,
    keys_of,
    metrics_of,
    title_of,
)
from dorothie_gym.benchmark.paper_results import PaperFigure, paper_figure, paper_figures
from dorothie_gym.benchmark.prediction_reader import read_about, read_predictions
from dorothie_gym.benchmark.predictions import (
    ActionPredictions,
    ActPredictions,
    TaskPredictions,
    act_labels,
    action_labels,
    write_predictions,
)
from dorothie_gym.benchmark.scoring import RunScore, Scores, score_runs, score_task
from dorothie_gym.benchmark.table import ResultsTable, evaluate_files, evaluate_predictions
from dorothie_gym.benchmark.trivial_baselines import (
    FLOORS,
    FloorModel,
    MajorityModel,
    RandomModel,
    make_floor,
    predict_floor,
)
from dorothie_gym.errors import PredictionError

__all__ = [
    "COLUMNS",
    "FLOORS",
    "SPLITS",
    "ActPredictions",
    "ActionAccuracy",
    "ActionPredictions",
    "ArgumentAccuracy",
    "ArgumentAccuracyPaper",
    "CorpusLabels",
    "Estimate",
    "FloorModel",
    "JointAccuracy",
    "JointAccuracyPaper",
    "MajorityModel",
    "Metric",
    "ModelClaim",
    "ModelFinding",
    "ModelVerdict",
    "MoveAccuracy",
    "PaperFigure",
    "PredictionError",
    "RandomModel",
    "ResultsTable",
    "RunScore",
    "Scores",
    "SlotF1",
    "SlotScorePaper",
    "Split",
    "TaskLabels",
    "TaskPredictions",
    "Unscored",
    "above",
    "act_labels",
    "action_labels",
    "evaluate_files",
    "evaluate_predictions",
    "findings",
    "keys_of",
    "labels_of",
    "make_floor",
    "metrics_of",
    "paper_figure",
    "paper_figures",
    "predict_floor",
    "read_about",
    "read_predictions",
    "score_runs",
    "score_task",
    "title_of",
    "write_predictions",
]
