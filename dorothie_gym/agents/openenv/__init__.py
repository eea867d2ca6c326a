"""Adapter to OpenEnv 0.10 (extra `openenv`): server and client of sessions by text (docs/agents-openenv.md)."""
