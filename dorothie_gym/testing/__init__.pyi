"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .checks import check_policy as check_policy
from .checks import check_session as check_session
from .checks import check_town as check_town
from .installation import check_installation as check_installation
from .leaks import check_observations_do_not_leak as check_observations_do_not_leak
