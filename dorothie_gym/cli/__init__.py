"""Command line: the application `dorothie-gym` and one module for each group of its commands."""

from dorothie_gym.cli.app import app, main

__all__ = ["app", "main"]
