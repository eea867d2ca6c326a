"""Names of the files in the folder of a session."""

from __future__ import annotations

from typing import Final

HEADER_FILE: Final = "session.json"
"""`SessionHeader`, written whole before anything else."""

EVENTS_FILE: Final = "events.jsonl"
"""One event a line, appended as they happen."""

TRAJECTORY_FILE: Final = "trajectory.csv"
"""One frame a line, appended as they happen."""

SUMMARY_FILE: Final = "summary.json"
"""How the session ended and how many events and frames it has, written whole at its end."""

SESSION_FILES: Final = (HEADER_FILE, EVENTS_FILE, TRAJECTORY_FILE, SUMMARY_FILE)
