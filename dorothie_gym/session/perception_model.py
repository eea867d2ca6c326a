"""Perception models of the roles, in a module that settings and the command line can import quickly."""

from __future__ import annotations

import enum


class PerceptionModel(enum.StrEnum):
    """Bodies and landmarks that the participant and the Co-Wizard see."""

    SYMBOLIC = "symbolic"
    """All bodies around the car that are near enough for the weather."""

    CAMERA = "camera"
    """Those that the picture of the camera on the car shows: in front of it, and not hidden."""
