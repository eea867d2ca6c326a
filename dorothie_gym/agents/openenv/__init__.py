"""Adapter to OpenEnv 0.10 (extra `openenv`): server and client of sessions by text (docs/agents-openenv.md)."""

from typing import Final

SESSIONS: Final = 64
"""Usual largest number of sessions at once."""
