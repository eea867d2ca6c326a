"""The car that the roads have to fit: highway-env's, in figures."""

from __future__ import annotations

CAR_WIDTH = 2.0
"""Width of the car [m]."""

HALF_WIDTH = 0.5 * CAR_WIDTH
"""From the car's middle to its side [m]."""

SMALLEST_RADIUS = 3.82
"""Radius of its smallest turning circle [m]: a bicycle 5 m long with its front wheel at 60 degrees."""
