"""Model inputs: a corpus as columns, its points, and batches of the data visible at points."""

from dorothie_gym.benchmark.features.batch import HISTORY, Batch, BatchSpec, HistorySizes, gather
from dorothie_gym.benchmark.features.columns import (
    CO_WIZARD,
    NO_TEXT,
    PARTICIPANT,
    ActionRows,
    Columns,
    FrameRows,
    GoalRows,
    LandmarkRows,
    LookRows,
    MoveRows,
    ObjectRows,
    SessionRows,
    StreetRows,
    TownGraph,
    UtteranceRows,
)
from dorothie_gym.benchmark.features.corpus_columns import build, columns_of
from dorothie_gym.benchmark.features.point_table import PointTable, points
from dorothie_gym.benchmark.features.sight import Sight, VisibleBoxes
from dorothie_gym.recording.recorded_perception import OBJECT_VALUES, ObjectKind
from dorothie_gym.recording.trajectory import TENTHS

__all__ = [
    "CO_WIZARD",
    "HISTORY",
    "NO_TEXT",
    "OBJECT_VALUES",
    "PARTICIPANT",
    "TENTHS",
    "ActionRows",
    "Batch",
    "BatchSpec",
    "Columns",
    "FrameRows",
    "GoalRows",
    "HistorySizes",
    "LandmarkRows",
    "LookRows",
    "MoveRows",
    "ObjectKind",
    "ObjectRows",
    "PointTable",
    "SessionRows",
    "Sight",
    "StreetRows",
    "TownGraph",
    "UtteranceRows",
    "VisibleBoxes",
    "build",
    "columns_of",
    "gather",
    "points",
]
