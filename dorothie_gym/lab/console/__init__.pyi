"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .config import AbsenceRules as AbsenceRules
from .config import AfterAbsence as AfterAbsence
from .config import ConsoleConfig as ConsoleConfig
from .config import WhileAway as WhileAway
from .resuming import Resumed as Resumed
from .resuming import interrupted_sessions as interrupted_sessions
from .room import Room as Room
from .seating import parse_roles as parse_roles
from .server import Console as Console
