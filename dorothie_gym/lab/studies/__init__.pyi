"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .assignment import Assigner as Assigner
from .entrance import Entrance as Entrance
from .erasure import erase as erase
from .erasure import find_traces as find_traces
from .erasure import finish_erasures as finish_erasures
from .erasure import is_unfinished as is_unfinished
from .export import export_study as export_study
from .folder import check_folder as check_folder
from .folder import open_study as open_study
from .folder import running_study as running_study
from .record_types import STUDY_FILE as STUDY_FILE
from .records import StudyRecords as StudyRecords
from .server import StudyServer as StudyServer
from .study import Admission as Admission
from .study import Study as Study
from .study_file import check_sources as check_sources
from .study_file import read_study as read_study
from .tier_study import tier_study as tier_study
