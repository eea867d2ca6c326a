"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .config import CoWizardStyle as CoWizardStyle
from .policy import PendingDecision as PendingDecision
from .policy import ScriptedCoWizard as ScriptedCoWizard
from .policy import attend as attend
from .policy import respond as respond
from .state import CoWizardState as CoWizardState
