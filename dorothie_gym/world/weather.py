"""Weather and light, as far as this world has what they act on: sight and grip."""

from __future__ import annotations

import math
from collections.abc import Mapping

from dorothie_gym.ontology import WeatherParameter

CLEAR_SIGHT = 80.0
"""How far bodies are perceived on a clear day [m]."""

SHORTEST_SIGHT = 16.0
"""How far they are perceived at worst [m]: enough to stop from 40 km/h on a dry road."""

FOG_FREE = 2.0
"""Fog density that CARLA's clear noon has [%]."""


class Weather:
    """The ten weather parameters and what they do."""

    def __init__(self) -> None:
        self.values: dict[WeatherParameter, float] = {p: float(p.clear_noon) for p in WeatherParameter}

    def set_share(self, parameter: WeatherParameter, share: float) -> float:
        """Sets a parameter to a share of its range; returns its value."""
        value = parameter.low + share * (parameter.high - parameter.low)
        self.values[parameter] = value
        return value

    def state(self) -> Mapping[WeatherParameter, float]:
        """The ten values."""
        return self.values

    @property
    def is_dark(self) -> bool:
        """Whether the sun is below the horizon."""
        return self.values[WeatherParameter.SUN_ALTITUDE_ANGLE] < 0.0

    @property
    def is_foggy(self) -> bool:
        """Whether fog takes more than a third of the sight."""
        return self.values[WeatherParameter.FOG_DENSITY] > 30.0

    def sight(self, *, lights: bool) -> float:
        """How far bodies are perceived [m]; shorter with fog, rain and darkness, longer in the dark with lights on.

        Fog scales sight by exp(-2 density) (Koschmieder 1924: contrast falls off exponentially), rain takes up to a
        quarter, darkness a half, or a quarter with lights on.
        """
        fog = max(self.values[WeatherParameter.FOG_DENSITY] - FOG_FREE, 0.0) / 100.0
        rain = self.values[WeatherParameter.PRECIPITATION] / 100.0
        dark = 0.0
        if self.is_dark:
            dark = 0.25 if lights else 0.5
        return max(CLEAR_SIGHT * math.exp(-2.0 * fog) * (1.0 - 0.25 * rain) * (1.0 - dark), SHORTEST_SIGHT)

    @property
    def friction(self) -> float:
        """Share of the dry road's grip: a wet road has about seven tenths of it (Wong, Theory of Ground Vehicles)."""
        wet = max(self.values[WeatherParameter.WETNESS], self.values[WeatherParameter.PRECIPITATION_DEPOSITS])
        return 1.0 - 0.3 * wet / 100.0
