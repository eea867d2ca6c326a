"""Directions as speakers name them: left, right, straight on and back, relative to the heading of the car."""

from __future__ import annotations

import enum


class Direction(enum.StrEnum):
    """Direction relative to the heading of the car."""

    LEFT = "left"
    RIGHT = "right"
    STRAIGHT = "straight"
    BACK = "back"
