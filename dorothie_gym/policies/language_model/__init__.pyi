"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .config import URL_VARIABLE as URL_VARIABLE
from .config import LanguageModelConfig as LanguageModelConfig
from .config import SimulatedTime as SimulatedTime
from .faults import Fault as Fault
from .policy import LanguageModelPolicy as LanguageModelPolicy
from .request_parameters import parse_parameters as parse_parameters
from .usage import ModelUsage as ModelUsage
