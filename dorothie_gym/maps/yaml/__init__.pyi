"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .compile import import_yaml_town as import_yaml_town
from .compile import read_yaml_town as read_yaml_town
