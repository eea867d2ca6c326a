"""Environments in which a human, a driving wizard and an adversary talk while a car drives through a town."""

__version__ = "0.1.0"
