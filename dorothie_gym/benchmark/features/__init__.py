"""Model inputs: a corpus as columns, its points, and batches of the data visible at points."""

from dorothie_gym.benchmark.features.batch import HISTORY, Batch, BatchSpec, HistorySizes, gather
from dorothie_gym.benchmark.features.building import build, columns_of
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
from dorothie_gym.benchmark.features.point_table import PointTable, points
from dorothie_gym.recording.recorded_perception import OBJECT_VALUES, ObjectKind
from dorothie_gym.recording.trajectory import TENTHS

__all__ = [
    "ActionRows",
    "Batch",
    "BatchSpec",
    "CO_WIZARD",
    "Columns",
    "FrameRows",
    "GoalRows",
    "HISTORY",
    "HistorySizes",
    "LandmarkRows",
    "LookRows",
    "MoveRows",
    "NO_TEXT",
    "OBJECT_VALUES",
    "ObjectKind",
    "ObjectRows",
    "PARTICIPANT",
    "PointTable",
    "SessionRows",
    "StreetRows",
    "TENTHS",
    "TownGraph",
    "UtteranceRows",
    "build",
    "columns_of",
    "gather",
    "points",
]
