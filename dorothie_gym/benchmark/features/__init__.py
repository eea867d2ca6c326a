"""What a model is given: a corpus as columns, its points, and batches of what may be seen at them."""

from dorothie_gym.benchmark.features.batch import HISTORY, Batch, BatchSpec, HistorySizes, gather
from dorothie_gym.benchmark.features.building import build, columns_of
from dorothie_gym.benchmark.features.columns import (
    CO_WIZARD,
    NO_TEXT,
    PARTICIPANT,
    Actions,
    Columns,
    Frames,
    Goals,
    Landmarks,
    Looks,
    Moves,
    Objects,
    Sessions,
    Streets,
    TownGraph,
    Utterances,
)
from dorothie_gym.benchmark.features.point_table import PointTable, points
from dorothie_gym.recording.recorded_perception import OBJECT_VALUES, ObjectKind
from dorothie_gym.recording.trajectory import TENTHS

__all__ = [
    "Actions",
    "Batch",
    "BatchSpec",
    "CO_WIZARD",
    "Columns",
    "Frames",
    "Goals",
    "HISTORY",
    "HistorySizes",
    "Landmarks",
    "Looks",
    "Moves",
    "NO_TEXT",
    "OBJECT_VALUES",
    "ObjectKind",
    "Objects",
    "PARTICIPANT",
    "PointTable",
    "Sessions",
    "Streets",
    "TENTHS",
    "TownGraph",
    "Utterances",
    "build",
    "columns_of",
    "gather",
    "points",
]
