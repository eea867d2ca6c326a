"""Aerial view of a town with all actors: the whole town, or a window that follows the car."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps.floating_names import Box, FloatingNames, overlap
from dorothie_gym.pictures.maps.town_map import MapPainter, draw_scale_bar
from dorothie_gym.pictures.text import font
from dorothie_gym.pictures.views.sprites import (
    PIN_LENGTH,
    Canvas,
    draw_actor,
    draw_car,
    draw_direction,
    draw_estimate,
    draw_exception,
    draw_headlights,
    draw_pin,
    draw_start,
    draw_trail,
    draw_waypoints,
    pin_direction,
)
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.pictures.views.scene import Pin, Scene

_NIGHT = (126, 138, 184)
_OVERCAST = (226, 230, 236)
_FOG = (222, 226, 230)
_RAIN = (176, 194, 222)


def darkness(weather: Mapping[str, float]) -> float:
    """Returns the darkness, from 0 with the sun 12 degrees above the horizon to 1 with it 6 degrees below."""
    altitude = _value(weather, WeatherParameter.SUN_ALTITUDE_ANGLE)
    return float(np.clip((12.0 - altitude) / 18.0, 0.0, 1.0))


def weather_summary(weather: Mapping[str, float]) -> str:
    """Returns the weather in a few words, such as "night, heavy rain, fog"."""
    dark = darkness(weather)
    parts = ["night" if dark > 0.85 else "dusk" if dark > 0.15 else "day"]
    rain = _value(weather, WeatherParameter.PRECIPITATION)
    fog = _value(weather, WeatherParameter.FOG_DENSITY)
    if rain > 60:
        parts.append("heavy rain")
    elif rain > 10:
        parts.append("rain")
    elif _value(weather, WeatherParameter.CLOUDINESS) > 60:
        parts.append("overcast")
    elif fog <= 15:
        parts.append("clear")
    if fog > 15:
        parts.append("dense fog" if fog > 60 else "fog")
    if rain <= 10 and _value(weather, WeatherParameter.WETNESS) > 30:
        parts.append("wet road")
    return ", ".join(parts)


def apply_weather(picture: pygame.Surface, weather: Mapping[str, float], time: float) -> None:
    """Tints a picture in place, lightly enough to remain legible.

    Args:
        picture: surface to tint.
        weather: parameters by name; missing ones have their values of a clear noon.
        time: time that animates the rain [s].
    """
    dark = darkness(weather)
    grey = _value(weather, WeatherParameter.CLOUDINESS) / 100.0
    factor = [255.0 + (n - 255.0) * dark for n in _NIGHT]
    factor = [f * (255.0 + (c - 255.0) * grey) / 255.0 for f, c in zip(factor, _OVERCAST, strict=True)]
    tint = tuple(round(f) for f in factor)
    if tint != (255, 255, 255):
        picture.fill(tint, special_flags=pygame.BLEND_RGB_MULT)
    fog = np.clip(_value(weather, WeatherParameter.FOG_DENSITY) / 100.0 - 0.02, 0.0, 1.0)
    if fog > 0.01:
        veil = pygame.Surface(picture.get_size())
        veil.fill(tuple(round(c * (1.0 - 0.55 * dark)) for c in _FOG))
        veil.set_alpha(round(150 * fog))
        picture.blit(veil, (0, 0))
    rain = _value(weather, WeatherParameter.PRECIPITATION) / 100.0
    if rain > 0.05:
        _draw_rain(picture, rain, _value(weather, WeatherParameter.WIND_INTENSITY) / 100.0, time)


def _draw_rain(picture: pygame.Surface, strength: float, wind: float, time: float) -> None:
    width, height = picture.get_size()
    rng = np.random.default_rng(round(time * 30.0) & 0xFFFFFFFF)
    layer = pygame.Surface((width, height), pygame.SRCALPHA, 32)
    drop = np.array([-4.0 - 10.0 * wind, 14.0])
    for start in rng.uniform((0.0, 0.0), (width, height), (round(width * height / 2600.0 * strength), 2)):
        pygame.draw.aaline(layer, (*_RAIN, 190), start.tolist(), (start + drop).tolist())
    picture.blit(layer, (0, 0))


def _value(weather: Mapping[str, float], parameter: WeatherParameter) -> float:
    return float(weather.get(parameter.value, parameter.clear_noon))


# --- View ------------------------------------------------------------------------------------------------------------

_WINDOW = 160.0  # [m] across the shorter side when the view follows the car
_COUNTRY_AROUND = 30.0  # [m] of country around the base map of that view
_PIN_TYPE = 13  # [px]
_HEAD, _MARK, _CAR = 12.0, 13.0, 15.0  # [px] half the width of heads of pins, of marks of exceptions, and of the car
_SPACING = 360.0  # [px] between two labels of the same street
_PLACES = 0.3  # distance of the possible places of a name, relative to that of names
_TOWNS_KEPT = 2


class AerialView:
    """Draws the map of a scene. Base maps are painted once for each town and cached.

    Attributes:
        size: width and height [px].
    """

    def __init__(self, size: tuple[int, int], *, goals_only: bool = False) -> None:
        """Allocates the view.

        Args:
            size: width and height [px].
            goals_only: whether notes at the edge point to goals only, not to all landmarks outside the picture.
        """
        self.size, self._goals_only = size, goals_only
        self._canvas = Canvas(size)
        self._painters: dict[tuple[object, ...], tuple[MapPainter, FloatingNames]] = {}

    def draw(self, scene: Scene, follow: bool) -> pygame.Surface:
        """Returns a new surface with the whole town, or with about 160 m of it around the car."""
        painter, names = self._painter(scene, follow)
        car = np.array([scene.car.x, scene.car.y])
        if follow:
            picture = painter.window(car, self.size, scene.time)
            corner = np.round(painter.to_pixel(car) - np.array(self.size) / 2.0)
        else:
            picture = painter.surface(scene.time)
            corner = np.zeros(2)
        apply_weather(picture, scene.weather, scene.time)
        canvas = self._canvas
        canvas.begin(painter.scale, painter.origin + corner / painter.scale)
        self._draw_ways(canvas, scene)
        canvas.blit_on(picture)
        boxes = names.draw(picture, self._kept_free(canvas, scene), corner)
        canvas.begin(painter.scale, painter.origin + corner / painter.scale)
        self._draw_traffic(canvas, scene)
        self._draw_pins(canvas, scene, follow, boxes)
        canvas.blit_on(picture)
        draw_scale_bar(picture, painter.scale, (14, self.size[1] - 14), 150)
        return picture

    def _kept_free(self, canvas: Canvas, scene: Scene) -> list[Box]:
        """Returns boxes that street names leave free: of the scale bar, the car, the marks of exceptions, and pins."""
        found = [self._scale_bar, _square(canvas.pixel((scene.car.x, scene.car.y)), _CAR)]
        for mark in scene.exceptions:
            found.append(_square(canvas.pixel((mark.x, mark.y)), _MARK))
        for pin in scene.landmarks:
            found += [_square(canvas.pixel((pin.x, pin.y)), 2.0), _square(_head(canvas, pin), _HEAD)]
        return found

    @property
    def _scale_bar(self) -> Box:
        return 14.0, self.size[1] - 48.0, 210.0, 34.0

    def _painter(self, scene: Scene, follow: bool) -> tuple[MapPainter, FloatingNames]:
        names = None if scene.street_names is None else tuple(scene.street_names)
        # the painter keeps its town alive, so that its id stays unique as long as the entry
        key = (id(scene.town), names, follow)
        if key not in self._painters:
            while len(self._painters) >= 2 * _TOWNS_KEPT:
                del self._painters[next(iter(self._painters))]
            if follow:
                scale = min(self.size) / _WINDOW
                made = MapPainter.at_scale(
                    scene.town,
                    scale,
                    street_names=names,
                    type_sizes=(18, 12),
                    label_spacing=_PLACES * _SPACING,
                    margin=round(_COUNTRY_AROUND * scale),
                    names_on_top=True,
                )
            else:
                margin = (20, 40, 20, 52)
                made = MapPainter(
                    scene.town,
                    size=self.size,
                    street_names=names,
                    margin=margin,
                    type_sizes=(16, 11),
                    label_spacing=_PLACES * _SPACING,
                    names_on_top=True,
                )
            self._painters[key] = made, FloatingNames(made.labels, _SPACING)
        return self._painters[key]

    def _draw_ways(self, canvas: Canvas, scene: Scene) -> None:
        """Draws what lies below street names: the driven and the planned path."""
        car = scene.car
        if car.lights:
            draw_headlights(canvas, np.array([car.x, car.y]), car.heading, car.length, car.width)
        draw_trail(canvas, scene.trail)
        draw_direction(canvas, scene.trail)
        if len(scene.trail):
            draw_start(canvas, scene.trail[0])
        draw_waypoints(canvas, scene.waypoints)

    def _draw_traffic(self, canvas: Canvas, scene: Scene) -> None:
        car = scene.car
        at = np.array([car.x, car.y])
        for estimate in scene.estimates:
            colour = palette.STATE["none"] if estimate.label else palette.CAR
            draw_estimate(canvas, np.array([estimate.x, estimate.y]), estimate.covariance, colour)
        for actor in scene.others:
            if canvas.shows((actor.x, actor.y), -30.0):
                place = np.array([actor.x, actor.y])
                draw_actor(canvas, actor.kind, place, actor.heading, actor.length, actor.width)
        for number, mark in enumerate(scene.exceptions, 1):
            if canvas.shows((mark.x, mark.y), -12.0):
                draw_exception(canvas, np.array([mark.x, mark.y]), number)
        draw_car(canvas, at, car.heading, car.length, car.width)

    def _draw_pins(self, canvas: Canvas, scene: Scene, follow: bool, names: list[Box]) -> None:
        taken: list[Box] = [self._scale_bar, _square(canvas.pixel((scene.car.x, scene.car.y)), _CAR)]
        seen: list[Pin] = []
        away: list[Pin] = []
        for pin in scene.landmarks:
            (seen if canvas.shows((pin.x, pin.y), 4.0) else away).append(pin)
        for pin in sorted(seen, key=lambda p: p.y):
            colour = palette.STATE[pin.state]
            done = pin.state == "complete"
            draw_pin(canvas, np.array([pin.x, pin.y]), np.array(pin.waypoint), colour, pin.hidden and not done, done)
            taken.append(_square(_head(canvas, pin), _HEAD))
        for pin in seen:
            self._write_name(canvas, pin, taken, names)
        if follow:
            for pin in away:
                if self._goals_only and pin.state not in ("pending", "ongoing"):
                    continue
                self._point_to(canvas, pin, taken)

    def _write_name(self, canvas: Canvas, pin: Pin, taken: list[Box], names: list[Box]) -> None:
        """Draws the name of a pin on the side where it covers least."""
        x, y = _head(canvas, pin).tolist()
        width, height = font(_PIN_TYPE, True).size(pin.label)[0] + 14, 22
        options: list[Box] = [
            (x + 15, y - height / 2, width, height),
            (x - 15 - width, y - height / 2, width, height),
            (x - width / 2, y - 17 - height, width, height),
            (x - width / 2, y + 17, width, height),
        ]
        box = min(options, key=lambda b: sum(overlap(b, other) for other in (*taken, *names)) + self._lost(b))
        taken.append(box)
        canvas.box(box, palette.PAPER, palette.STATE[pin.state])
        ink = palette.STATE_INK[pin.state]
        canvas.text(pin.label, box[0] + 7, box[1] + height / 2, _PIN_TYPE, ink, bold=True)

    def _point_to(self, canvas: Canvas, pin: Pin, taken: list[Box]) -> None:
        """Draws a note at the edge of the picture with the direction of a landmark outside it."""
        centre = np.array(self.size) / 2.0
        direction = canvas.pixel((pin.x, pin.y)) - centre
        metres = float(pn.hypot(*direction)) / canvas.scale
        text = f"{pin.label}  {metres:.0f} m"
        width, height = font(_PIN_TYPE - 1).size(text)[0] + 34, 22
        room = centre - np.array([width / 2 + 8, height / 2 + 8])
        at = centre + direction * float(np.min(room / np.maximum(np.abs(direction), 1e-9)))
        box = (float(at[0]) - width / 2, float(at[1]) - height / 2, width, height)
        # One note above the other where several landmarks lie in the same direction.
        step = -(height + 4.0) if direction[1] > 0 else height + 4.0
        for _ in range(12):
            if not any(overlap(box, other) for other in taken):
                break
            box = (box[0], box[1] + step, width, height)
        taken.append(box)
        colour = palette.STATE[pin.state]
        canvas.box(box, palette.PAPER, colour, radius=11)
        unit = direction / max(float(pn.hypot(*direction)), 1e-9)
        side = np.array([-unit[1], unit[0]])
        tip = np.array([box[0] + 13, box[1] + height / 2])
        canvas.pixel_polygon(
            np.array([tip + 6 * unit, tip - 4 * unit + 4.5 * side, tip - 4 * unit - 4.5 * side]), colour
        )
        canvas.text(text, box[0] + 25, box[1] + height / 2, _PIN_TYPE - 1, palette.STATE_INK[pin.state])

    def _lost(self, box: Box) -> float:
        """Returns twice the area of a box outside the picture [px2]."""
        _x, _y, width, height = box
        inside = overlap(box, (0.0, 0.0, float(self.size[0]), float(self.size[1])))
        return 2.0 * (width * height - inside)


def _head(canvas: Canvas, pin: Pin) -> NDArray[np.float64]:
    """Returns the centre of the head of a pin (2,) [px]."""
    at = np.array([pin.x, pin.y])
    return canvas.pixel(at) + PIN_LENGTH * pin_direction(at, np.array(pin.waypoint))


def _square(centre: NDArray[np.float64], half: float) -> Box:
    """Returns a box around a point (2,) [px]."""
    x, y = centre.tolist()
    return x - half, y - half, 2.0 * half, 2.0 * half
