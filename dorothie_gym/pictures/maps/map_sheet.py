"""Map sheet of a town: framed map with title, legend, scale bar and north arrow."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.maps.folds import TownFold
from dorothie_gym.maps.model import Array, LinkType, SignalKind
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps.borders import BorderKind
from dorothie_gym.pictures.maps.ground import town_bounds
from dorothie_gym.pictures.maps.icons import ICON_SUPERSAMPLING, pin_icon, sign_icon, stamp
from dorothie_gym.pictures.maps.markings import one_way_arrow, one_way_places, turn_arrow
from dorothie_gym.pictures.maps.town_map import BAR_LENGTHS, GROUND, MapPainter
from dorothie_gym.pictures.text import font, words
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.maps.map_layers import MapLayers

_ROWS = 4  # of the legend beside the title, if it is broad enough
_MOST_ROWS = 6
_ROW = 2.2  # [units] height of a row of the legend
_HIGH = 1.9  # [units] height of a swatch
_WIDEST_SHEET = 3.2
_ENTRY = _WIDEST_SHEET + 0.9  # [units] from the left end of an entry to its text
_COLUMN_GAP = 2.2  # [units]
_BESIDE_TITLE, _BESIDE_SCALE = 3.5, 3.0  # [units] between the legend and its neighbours
_TITLE_SHARE = 0.42  # of the width of the sheet, for the name of the town
_METRES = 8.0  # width of a swatch for shapes in metres

_TEXTS = (
    "landmark site", "traffic light", "stop", "yield", "crosswalk", "ways on from a lane", "one-way street",
    "lanes of one direction", "between directions", "planted median", "bridge", "tunnel",
)  # fmt: skip
"""Texts of all entries that a legend may have, in their order."""


class LegendPlace(NamedTuple):
    """Place of the legend on a sheet, which has room for all entries that there may be.

    Attributes:
        rows: number of rows in a column.
        below: whether it is below title and scale bar, as wide as the sheet, instead of between them.
    """

    rows: int
    below: bool

    @property
    def height(self) -> float:
        """Height that it needs in addition to that of the title [units]."""
        return 0.6 + _ROW * self.rows if self.below else _ROW * max(0, self.rows - _ROWS)


def legend_place(unit: float, beside: float, whole: float) -> LegendPlace:
    """Returns the place of a legend with room for all entries.

    Args:
        unit: base length of the sheet [px].
        beside: width between title and scale bar [px].
        whole: width of the sheet without its edges [px].
    """
    for rows in range(_ROWS, _MOST_ROWS + 1):
        if _columns_width(_TEXTS, rows, unit) <= beside:
            return LegendPlace(rows, below=False)
    rows = next((rows for rows in range(1, len(_TEXTS)) if _columns_width(_TEXTS, rows, unit) <= whole), len(_TEXTS))
    return LegendPlace(rows, below=True)


def _columns_width(texts: Sequence[str], rows: int, unit: float) -> float:
    """Returns the width of columns of entries [px]."""
    face = font(_key_type(unit))
    columns = [texts[k : k + rows] for k in range(0, len(texts), rows)]
    wide = sum(max(face.size(text)[0] for text in column) + _ENTRY * unit for column in columns)
    return wide + (len(columns) - 1) * _COLUMN_GAP * unit


class Legend:
    """Legend of a map.

    Attributes:
        entries: pairs of text and swatch function, in order.
    """

    def __init__(self, town: Town, plan: MapLayers, unit: float) -> None:
        """Selects the entries for a map; `unit` is the base length of the sheet [px]."""
        self._unit = unit
        kinds = {border.kind for border in plan.borders.lines}
        signals = {post.kind for post in plan.posts}
        size = round(_HIGH * unit)
        known: dict[str, tuple[bool, Callable[[], pygame.Surface]]] = {
            "landmark site": (bool(town.sites), lambda: pin_icon("7", round(0.72 * unit), 90)),
            "traffic light": (
                SignalKind.TRAFFIC_LIGHT in signals,
                lambda: sign_icon(SignalKind.TRAFFIC_LIGHT, size),
            ),
            "stop": (SignalKind.STOP in signals, lambda: sign_icon(SignalKind.STOP, size)),
            "yield": (SignalKind.YIELD in signals, lambda: sign_icon(SignalKind.YIELD, size)),
            "crosswalk": (bool(town.crosswalks), self._crosswalk),
            "ways on from a lane": (bool(plan.arrows) and plan.detail.arrows, self._arrow),
            "one-way street": (any(True for _ in one_way_places(town, plan.borders)), self._one_way),
            "lanes of one direction": (BorderKind.LANE in kinds, self._lanes),
            "between directions": (BorderKind.CENTRE in kinds, self._centre),
            "planted median": (BorderKind.MEDIAN in kinds, self._median),
            "bridge": (any(part.level > 0 for part in plan.stretches), self._bridge),
            "tunnel": (any(part.level < 0 for part in plan.stretches), self._tunnel),
        }
        self.entries = tuple((text, known[text][1]) for text in _TEXTS if known[text][0])

    def draw(self, surface: pygame.Surface, left: float, top: float, rows: int) -> float:
        """Draws all entries in columns of a number of rows, from a corner [px] on; returns their right end [px]."""
        unit = self._unit
        x = left
        for column in range(0, len(self.entries), rows):
            shown = [
                (words(text, _key_type(unit), palette.INK), draw) for text, draw in self.entries[column : column + rows]
            ]
            for k, (text, draw) in enumerate(shown):
                middle = top + (0.6 + _ROW * k) * unit
                stamp(surface, draw(), np.array([x + _WIDEST_SHEET * unit / 2.0, middle]))
                surface.blit(text, (round(x + _ENTRY * unit), round(middle - text.get_height() / 2.0)))
            x += max(text.get_width() for text, _ in shown) + (_ENTRY + _COLUMN_GAP) * unit
        return x - _COLUMN_GAP * unit

    def _swatch(self, *shapes: tuple[Array, palette.Colour], ground: palette.Colour = palette.ROAD) -> pygame.Surface:
        """Returns a swatch of map, `_METRES` wide, with its centre at (0, 0)."""
        wide, high = round(_WIDEST_SHEET * self._unit), round(_HIGH * self._unit)
        fine = pygame.Surface((wide * ICON_SUPERSAMPLING, high * ICON_SUPERSAMPLING), pygame.SRCALPHA, 32)
        pygame.draw.rect(fine, ground, fine.get_rect(), border_radius=round(0.25 * self._unit * ICON_SUPERSAMPLING))
        scale = wide * ICON_SUPERSAMPLING / _METRES
        for points, colour in shapes:
            pygame.draw.polygon(fine, colour, (points * scale + np.array(fine.get_size()) / 2.0).tolist())
        return pygame.transform.smoothscale(fine.premul_alpha(), (wide, high))

    def _crosswalk(self) -> pygame.Surface:
        bars = [_box(x, x + 0.7, -1.7, 1.7) for x in np.arange(-3.3, 3.0, 1.35)]
        return self._swatch(*((bar, palette.ZEBRA) for bar in bars))

    def _arrow(self) -> pygame.Surface:
        outlines = turn_arrow((LinkType.STRAIGHT, LinkType.LEFT), np.array([-3.1, 0.5]), 0.0)
        return self._swatch(*((outline, palette.ARROW) for outline in outlines))

    def _one_way(self) -> pygame.Surface:
        return self._swatch(*((outline, palette.ONE_WAY) for outline in one_way_arrow(np.zeros(2), 0.0, 6.4)))

    def _lanes(self) -> pygame.Surface:
        return self._swatch(*((_box(x, x + 2.0, -0.15, 0.15), palette.LANE_LINE) for x in (-3.4, -1.0, 1.4)))

    def _centre(self) -> pygame.Surface:
        return self._swatch(*((_box(-4.0, 4.0, y - 0.13, y + 0.13), palette.CENTRE_LINE) for y in (-0.35, 0.35)))

    def _median(self) -> pygame.Surface:
        return self._swatch(
            (_box(-4.0, 4.0, -1.1, 1.1), palette.MEDIAN_KERB), (_box(-4.0, 4.0, -0.8, 0.8), palette.MEDIAN)
        )

    def _bridge(self) -> pygame.Surface:
        sides = [(y, y + 0.35) for y in (-1.85, 1.5)]
        return self._swatch(*((_box(-4.0, 4.0, a, b), palette.BRIDGE_EDGE) for a, b in sides))

    def _tunnel(self) -> pygame.Surface:
        dashes = [_box(x, x + 1.1, y, y + 0.35) for x in np.arange(-3.8, 3.5, 1.8) for y in (-1.85, 1.5)]
        return self._swatch(*((dash, palette.TUNNEL_EDGE) for dash in dashes), ground=palette.TUNNEL)


def _box(x0: float, x1: float, y0: float, y1: float) -> Array:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


# --- Sheet -----------------------------------------------------------------------------------------------------------

_LARGEST = 4000  # [px] on the long side
_FINEST = 12.0  # [px/m]
_SMALLEST_SHEET = 1400  # [px] on the long side
_NAME_HEIGHT = 7.0  # [m] font size on the broadest roads
_NAME_SPACING = 120.0  # [m]
_STRIPS = 3  # height of a flat sheet, in strips below the map
_FEWEST_STRIPS = 2  # smallest height that is accepted
_SMALLEST_TYPE = 0.0068  # of the long side: legible when the whole sheet is visible
_LARGE_TYPE = 0.0105  # of the long side: prominent, on roads that are broad enough


def sheet_size(town: Town) -> tuple[int, int]:
    """Returns the size [px] of a legible sheet of a town: up to 4000 px on the long side."""
    x0, y0, x1, y1 = town_bounds(town, GROUND)
    extent = np.array([x1 - x0, y1 - y0])
    long = float(np.clip(extent.max() * _FINEST, _SMALLEST_SHEET, 0.96 * _LARGEST))
    width, height = extent * long / extent.max()
    # a narrow town needs room for title and legend
    width = max(width, 0.7 * height)
    unit = _unit(width)
    key = site_key(town, [street.name for street in town.streets], unit, width)
    place = _legend_place(town, unit, width + 4.0 * unit)
    whole = np.array([width + 4.0 * unit, height + 2.0 * unit + _strip(unit, len(key), place)])
    whole *= min(1.0, _LARGEST / whole.max())
    wide, high = round(float(whole[0])), round(float(whole[1]))
    # so does a flat one; see `sheet_painter`
    return wide, max(high, _STRIPS * _measures(town, [street.name for street in town.streets], wide)[2])


def sheet_painter(
    town: Town, size: tuple[int, int] | None = None, street_names: Sequence[str] | None = None
) -> MapPainter:
    """Returns the painter of the map on a sheet; labels are placed, nothing is painted yet.

    Args:
        town: town to paint.
        size: width and height of the sheet [px]; by default that of `sheet_size`.
        street_names: names by street index; the town's own if omitted.

    Raises:
        ValueError: the size is too small for a title and a map.
    """
    size = sheet_size(town) if size is None else size
    names = [street.name for street in town.streets] if street_names is None else street_names
    _, edge, strip = _measures(town, names, size[0])
    if size[1] < _FEWEST_STRIPS * strip:
        raise ValueError(f"size: {size} is too small for a title and a map")
    x0, y0, x1, y1 = town_bounds(town, GROUND)
    inner = np.array([size[0] - 2 * edge, size[1] - edge - strip], dtype=float)
    scale = float((inner / np.array([x1 - x0, y1 - y0])).min())
    small = max(10, round(_SMALLEST_TYPE * max(size)))
    return MapPainter(
        town,
        size=size,
        street_names=street_names,
        margin=(edge, edge, edge, strip),
        type_sizes=(max(small, round(_NAME_HEIGHT * scale), round(_LARGE_TYPE * max(size))), small),
        label_spacing=max(0.15 * max(size), _NAME_SPACING * scale),
        numbered=True,
        smallest_sign=max(12, small),
    )


def town_picture(
    town: Town,
    path: str | os.PathLike[str],
    size: tuple[int, int] | None = None,
    street_names: Sequence[str] | None = None,
    *,
    time: float | None = None,
    fold: str | None = None,
) -> MapPainter:
    """Writes the map sheet of a town as a PNG file.

    Args:
        town: town to paint.
        path: PNG file; its folder must exist.
        size: width and height [px]; by default that of `sheet_size`.
        street_names: names by street index; the town's own if omitted.
        time: simulated time of the light colours [s]; by default all lamps are on.
        fold: fold of the town, shown beside the figures ("seen", "unseen").

    Returns:
        The painter, for conversions to pixels of the picture.

    Raises:
        FileNotFoundError: the folder of `path` does not exist.
        ValueError: the size is too small for a title and a map.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise FileNotFoundError(f"{target}: the folder {target.parent} does not exist; make it first")
    painter = sheet_painter(town, size, street_names)
    surface = painter.surface(time)
    _draw_sheet(surface, painter, fold)
    pygame.image.save(surface, str(target), ".png")
    return painter


def _measures(town: Town, street_names: Sequence[str], width: int) -> tuple[float, int, int]:
    """Returns unit, edge around the map and strip below it [px] for a sheet of a width [px]."""
    unit = _unit(width)
    edge = round(2.0 * unit)
    lines = len(site_key(town, street_names, unit, width - 2 * edge))
    return unit, edge, round(_strip(unit, lines, _legend_place(town, unit, width)))


def _legend_place(town: Town, unit: float, width: float) -> LegendPlace:
    """Returns the place of the legend on a sheet of a width [px], beside the widest title and scale bar."""
    whole = width - 4.0 * unit
    title = max(_title_width(town, fold, unit, width) for fold in (None, *TownFold))
    return legend_place(unit, whole - title - (_BESIDE_TITLE + _WIDEST_SCALE + _BESIDE_SCALE) * unit, whole)


def _unit(width: float) -> float:
    """Returns the unit of lengths around the map [px]: about the height of small type."""
    return max(9.0, width / 110.0)


def _strip(unit: float, key_lines: int, legend: LegendPlace) -> float:
    """Returns the height of the strip below the map [px], with the key of the sites below the legend."""
    return (11.0 + legend.height + (0.6 + _KEY_LINE * key_lines if key_lines else 0.0)) * unit


_KEY_LINE = 1.7  # [units] height of a line of the key
_KEY_TITLE = "Landmark sites:"


def site_key(town: Town, street_names: Sequence[str], unit: float, width: float) -> list[str]:
    """Returns the key of the numbered landmark sites: the street of each, in lines no wider than a width [px]."""
    numbers: dict[str, list[int]] = {}
    for site in town.sites:
        known = 0 <= site.street < len(street_names)
        numbers.setdefault(street_names[site.street] if known else "no street", []).append(site.id + 1)
    if not numbers:
        return []
    entries = [f"{_ranges(found)} {street}" for street, found in numbers.items()]
    face = font(_key_type(unit))
    lines = [_KEY_TITLE]
    for k, entry in enumerate(entries):
        longer = f"{lines[-1]}  {entry}" + ("  ·" if k + 1 < len(entries) else "")
        if face.size(longer)[0] <= width or lines[-1] == _KEY_TITLE:
            lines[-1] = longer
        else:
            lines.append(longer.removeprefix(lines[-1]).strip())
    return lines


def _key_type(unit: float) -> int:
    return max(9, round(1.15 * unit))


def _ranges(numbers: Sequence[int]) -> str:
    """Returns ascending numbers with their runs: "1-3, 7"."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}–{run[-1]}" for run in runs)


def _draw_sheet(surface: pygame.Surface, painter: MapPainter, fold: str | None) -> None:
    width, height = painter.size
    unit, edge, strip = _measures(painter.town, painter.street_names, width)
    inner = pygame.Rect(edge, edge, width - 2 * edge, height - edge - strip)
    for box in ((0, 0, width, edge), (0, 0, edge, height), (width - edge, 0, edge, height)):
        surface.fill(palette.SHEET, box)
    surface.fill(palette.SHEET, (0, inner.bottom, width, strip))
    thick = max(2, round(0.18 * unit))
    pygame.draw.rect(surface, palette.INK, inner.inflate(2 * thick, 2 * thick), thick)
    gap = 3 * thick
    pygame.draw.rect(surface, palette.INK, inner.inflate(2 * gap + 2, 2 * gap + 2), max(1, thick // 3))
    left, top = float(inner.left), inner.bottom + 1.9 * unit
    after = _draw_title(surface, painter.town, unit, left, top, fold)
    _draw_scale(surface, painter.scale, unit, float(inner.right), top)
    place = _legend_place(painter.town, unit, width)
    corner = (left, top + 9.6 * unit) if place.below else (after + _BESIDE_TITLE * unit, top)
    Legend(painter.town, painter.plan, unit).draw(surface, *corner, place.rows)
    for k, line in enumerate(site_key(painter.town, painter.street_names, unit, width - 2 * edge)):
        text = words(line, _key_type(unit), palette.INK)
        surface.blit(text, (round(left + 0.2 * unit), round(top + (9.0 + place.height + _KEY_LINE * k) * unit)))


def _draw_title(surface: pygame.Surface, town: Town, unit: float, left: float, top: float, fold: str | None) -> float:
    """Draws name and figures; returns their right end [px]."""
    surface.blit(_title_name(town, unit, surface.get_width()), (round(left), round(top - 0.3 * unit)))
    for k, fact in enumerate(_title_facts(town, fold)):
        line = words(fact, _key_type(unit), palette.INK_SOFT)
        surface.blit(line, (round(left + 0.2 * unit), round(top + (4.5 + 1.7 * k) * unit)))
    return left + _title_width(town, fold, unit, surface.get_width())


def _title_width(town: Town, fold: str | None, unit: float, width: float) -> float:
    """Returns the width of name and figures on a sheet of a width [px]."""
    lines = [words(fact, _key_type(unit), palette.INK_SOFT) for fact in _title_facts(town, fold)]
    return float(max(piece.get_width() for piece in (_title_name(town, unit, width), *lines)))


def _title_name(town: Town, unit: float, width: float) -> pygame.Surface:
    name = _spaced(town.name.upper(), round(3.6 * unit), 0.5 * unit)
    smaller = min(1.0, _TITLE_SHARE * width / max(1, name.get_width()))
    return name if smaller == 1.0 else _spaced(town.name.upper(), round(3.6 * unit * smaller), 0.5 * unit * smaller)


def _title_facts(town: Town, fold: str | None) -> list[str]:
    facts = [
        f"{town.kilometres:.1f} km of lanes  ·  {len(town.lanes)} lanes",
        f"{len(town.streets)} streets  ·  {len(town.junctions)} junctions  ·  {len(town.sites)} sites",
    ]
    if fold is not None:
        facts[0] += f"  ·  {fold}"
    return facts


def _spaced(text: str, size: int, space: float) -> pygame.Surface:
    """Returns a line of text with extra space between the letters."""
    letters = [words(letter, size, palette.INK, True) for letter in text]
    width = round(sum(letter.get_width() + space for letter in letters))
    line = pygame.Surface((max(1, width), letters[0].get_height() if letters else 1), pygame.SRCALPHA, 32)
    x = 0.0
    for letter in letters:
        line.blit(letter, (round(x), 0))
        x += letter.get_width() + space
    return line


_BAR, _BESIDE_BAR = 22.0, 6.5  # [units] largest length of the scale bar, and width of north arrow and numbers
_WIDEST_SCALE = _BAR + _BESIDE_BAR + 2.0


def _draw_scale(surface: pygame.Surface, scale: float, unit: float, right: float, top: float) -> None:
    """Draws north arrow and scale bar."""
    metres = max((n for n in BAR_LENGTHS if n * scale <= _BAR * unit), default=BAR_LENGTHS[0])
    length = round(metres * scale)
    centre = right - 1.6 * unit
    for side, ink in ((-1.0, palette.INK), (1.0, palette.INK_SOFT)):
        half = np.array([[0.0, 0.0], [1.3 * side, 4.2], [0.0, 3.3]]) * unit + np.array([centre, top])
        pygame.draw.polygon(surface, ink, half.tolist())
        pygame.draw.aalines(surface, ink, True, half.tolist())
    north = words("N", round(1.7 * unit), palette.INK, True)
    surface.blit(north, north.get_rect(midtop=(round(centre), round(top + 4.5 * unit))))
    left = right - _BESIDE_BAR * unit - length
    y, high = top + 4.9 * unit, max(3, round(0.5 * unit))
    for k in range(4):
        a, b = round(left + k * length / 4), round(left + (k + 1) * length / 4)
        pygame.draw.rect(surface, palette.INK if k % 2 == 0 else palette.PAPER, (a, round(y), b - a, high))
    pygame.draw.rect(surface, palette.INK, (round(left), round(y), length, high), max(1, high // 6))
    for share in (0.0, 0.5, 1.0):
        value = metres * share
        text = words(f"{value:g}" + (" m" if share == 1.0 else ""), max(9, round(1.15 * unit)), palette.INK)
        surface.blit(text, text.get_rect(midbottom=(round(left + share * length), round(y - 0.35 * unit))))
