"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .checks import TalkChecks as TalkChecks
from .checks import talk_checks_of as talk_checks_of
