"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .features import ExitTable as ExitTable
from .features import exit_table as exit_table
from .features import mentions as mentions
from .model import JunctionReader as JunctionReader
