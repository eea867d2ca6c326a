"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .corpus_cache import default_corpus as default_corpus
from .corpus_generation import Generated as Generated
from .corpus_generation import SessionPlan as SessionPlan
from .corpus_generation import finished_sessions as finished_sessions
from .corpus_generation import generate_corpus as generate_corpus
from .corpus_generation import plan_corpus as plan_corpus
from .frame_export import ExportedSession as ExportedSession
from .frame_export import FrameExport as FrameExport
from .frame_export import FrameLayout as FrameLayout
from .frame_export import export_frames as export_frames
from .hugging_face_export import export_hugging_face as export_hugging_face
from .minari_export import export_minari as export_minari
from .play import play_session as play_session
from .reference_drives import measure_drives as measure_drives
from .reference_drives import read_drives as read_drives
from .reference_drives import write_drives as write_drives
from .replay import ReplayCheck as ReplayCheck
from .replay import ReplaySources as ReplaySources
from .replay import begin_replay as begin_replay
from .replay import check_replays as check_replays
from .replay import resimulate as resimulate
from .replay import watch_session as watch_session
