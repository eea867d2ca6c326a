"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .actions import NavigationAction as NavigationAction
from .instructor import Guidance as Guidance
from .navigation_policy import NavigationPolicy as NavigationPolicy
from .observation_vector import FIELD_SPECS as FIELD_SPECS
from .observation_vector import FIELDS as FIELDS
from .observation_vector import layout as layout
