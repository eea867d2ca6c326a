"""Shared parts of the learned roles: rounds of imitation and practice, files of lessons, layers, and the fit."""
