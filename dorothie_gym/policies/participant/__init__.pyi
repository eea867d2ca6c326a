"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .policy import ScriptedParticipant as ScriptedParticipant
