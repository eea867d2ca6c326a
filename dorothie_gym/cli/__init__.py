"""The command line: `dorothie-gym run`, `towns`, `storyboards`, `evaluate` and `bench`."""

from dorothie_gym.cli.app import app, main

__all__ = ["app", "main"]
