"""Adapter to Inspect 0.3 (extra `inspect`): tasks `dorothie_gym/co_wizard` and others (docs/agents-inspect.md)."""
