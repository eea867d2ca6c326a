"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .catalogue import PHENOMENA as PHENOMENA
from .dialogue_view import DialogueView as DialogueView
from .dialogue_view import Occurrence as Occurrence
from .dialogue_view import Phenomenon as Phenomenon
from .dialogue_view import Turn as Turn
