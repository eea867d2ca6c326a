"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .actions import NavigationAction as NavigationAction
from .instructor import Guidance as Guidance
from .navigation_policy import NavigationPolicy as NavigationPolicy
from .observation_fields import FIELD_SPECS as FIELD_SPECS
from .observation_fields import FIELDS as FIELDS
from .observation_fields import layout as layout
