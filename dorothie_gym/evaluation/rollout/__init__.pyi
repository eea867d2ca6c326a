"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .corpus_cache import default_corpus as default_corpus
from .corpus_generation import Generated as Generated
from .corpus_generation import SessionPlan as SessionPlan
from .corpus_generation import finished_sessions as finished_sessions
from .corpus_generation import generate_corpus as generate_corpus
from .corpus_generation import plan_corpus as plan_corpus
from .play import play_session as play_session
from .replay import resimulate as resimulate
from .replay import watch_session as watch_session
