"""Drawn maps of towns."""
