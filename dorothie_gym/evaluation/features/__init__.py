"""What a model is given: a corpus as columns, its points, and batches of what may be seen at them."""

from dorothie_gym.evaluation.features.batch import Batch, BatchSpec, gather
from dorothie_gym.evaluation.features.building import build
from dorothie_gym.evaluation.features.columns import (
    CO_WIZARD,
    NO_TEXT,
    OBJECT_VALUES,
    PARTICIPANT,
    TENTHS,
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
from dorothie_gym.evaluation.features.table import PointTable, Skipped, points

__all__ = [
    "Actions", "Batch", "BatchSpec", "CO_WIZARD", "Columns", "Frames", "Goals", "Landmarks", "Looks", "Moves",
    "NO_TEXT", "OBJECT_VALUES", "Objects", "PARTICIPANT", "PointTable", "Sessions", "Skipped", "Streets", "TENTHS",
    "TownGraph", "Utterances", "build", "gather", "points",
]  # fmt: skip
