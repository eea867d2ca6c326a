"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .compile import import_opendrive as import_opendrive
from .compile import read_opendrive as read_opendrive
from .write import opendrive_text as opendrive_text
from .write import write_opendrive as write_opendrive
