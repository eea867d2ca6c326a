"""Recorded sessions: format, writer, readers, prediction points, corpora and comparison."""

from dorothie_gym.errors import SessionError
from dorothie_gym.recording.action_log import Decision
from dorothie_gym.recording.comparison import Difference, compare_folders, first_difference
from dorothie_gym.recording.corpus import (
    Corpus,
    CorpusEntry,
    load_readable,
    load_sessions,
    manifest_row,
    split_by_name,
    write_manifest,
)
from dorothie_gym.recording.events import (
    INFRACTIONS,
    ActionRecord,
    Event,
    EventType,
    InfractionRecord,
    MoveRecord,
    UtteranceRecord,
)
from dorothie_gym.recording.file_names import SessionState, safe_name
from dorothie_gym.recording.folder import session_state
from dorothie_gym.recording.header import FORMAT_VERSION, LandmarkRow, SessionHeader, SubgoalRow
from dorothie_gym.recording.points import (
    ANGLE_TOLERANCE,
    WAY_LENGTH,
    CarState,
    DecisionPoint,
    InferencePoint,
    Point,
    PointView,
    Task,
    angle_error,
    corpus_points,
    final_view,
    history_angle,
    is_decision,
    label_angle,
    nfd_points,
    rfn_points,
    task_points,
    ufn_points,
    unpointed_events,
)
from dorothie_gym.recording.reading import read_session, session_folders
from dorothie_gym.recording.recorded_perception import OBJECT_VALUES, ObjectKind, last_perceived
from dorothie_gym.recording.session import Session
from dorothie_gym.recording.splits import FOLDS, Fold
from dorothie_gym.recording.surroundings import (
    ACTOR_DTYPE,
    LIGHT_DTYPE,
    LIGHT_STATES,
    WEATHER_DTYPE,
    ActorKind,
    SceneTable,
    Surroundings,
)
from dorothie_gym.recording.trajectory import (
    NO_LANE,
    TRAJECTORY_COLUMNS,
    TRAJECTORY_DTYPE,
    Trajectory,
    rows_of,
    trajectory_of,
)
from dorothie_gym.recording.validation import ReadReport
from dorothie_gym.recording.writer import SessionWriter
from dorothie_gym.sim.config import FRAME_RATE

__all__ = [
    "ACTOR_DTYPE",
    "ANGLE_TOLERANCE",
    "FOLDS",
    "FORMAT_VERSION",
    "FRAME_RATE",
    "INFRACTIONS",
    "LIGHT_DTYPE",
    "LIGHT_STATES",
    "NO_LANE",
    "OBJECT_VALUES",
    "TRAJECTORY_COLUMNS",
    "TRAJECTORY_DTYPE",
    "WAY_LENGTH",
    "WEATHER_DTYPE",
    "ActionRecord",
    "ActorKind",
    "CarState",
    "Corpus",
    "CorpusEntry",
    "Decision",
    "DecisionPoint",
    "Difference",
    "Event",
    "EventType",
    "Fold",
    "InferencePoint",
    "InfractionRecord",
    "LandmarkRow",
    "MoveRecord",
    "ObjectKind",
    "Point",
    "PointView",
    "ReadReport",
    "SceneTable",
    "Session",
    "SessionError",
    "SessionHeader",
    "SessionState",
    "SessionWriter",
    "SubgoalRow",
    "Surroundings",
    "Task",
    "Trajectory",
    "UtteranceRecord",
    "angle_error",
    "compare_folders",
    "corpus_points",
    "final_view",
    "first_difference",
    "history_angle",
    "is_decision",
    "label_angle",
    "last_perceived",
    "load_readable",
    "load_sessions",
    "manifest_row",
    "nfd_points",
    "read_session",
    "rfn_points",
    "rows_of",
    "safe_name",
    "session_folders",
    "session_state",
    "split_by_name",
    "task_points",
    "trajectory_of",
    "ufn_points",
    "unpointed_events",
    "write_manifest",
]
