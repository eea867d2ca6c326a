"""Sensing of the ego car: visibility, perception of actors, localization."""
