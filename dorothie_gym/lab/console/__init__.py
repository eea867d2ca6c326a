"""Browser console: seats for people in sessions that run in real time."""
