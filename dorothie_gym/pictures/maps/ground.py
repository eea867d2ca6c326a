"""Ground enclosed by the road network: blocks between streets, and asphalt of junctions outside the lanes."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps.shapes import Shape, disc, ribbon, simplified, strokes
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.palette import Colour

# Larger holes between connectors are islands (such as the centre of a roundabout), not asphalt [m2].
_LARGEST_HOLE = 160.0
_CLOSING = 2.5  # [m]
_MOUTH = 6.0  # [m] of the lanes before and after a junction that belong to its asphalt
_INSET = 0.1  # [m] by which lanes are narrowed: rasterization widens them
_OUTLINE_SMOOTHING = 5
_RIM = 2.6  # [m]
_BLOCK_SCALE = 1.0  # [px/m]: edges of blocks lie under roads, so 1 m is sufficient
_HOLE_SCALE = 4.0
_PARK_TREE_SPACING = 13.0  # [m]
_SLIVER = 500.0  # [m2]
_SMALLEST_PARK = 1500.0  # [m2]


def town_bounds(town: Town, margin: float = 0.0) -> tuple[float, float, float, float]:
    """Returns smallest x, y and largest x, y [m] of all lanes, extended by a margin [m]."""
    points = np.concatenate([lane.points[:, :2] for lane in town.lanes])
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


@dataclass(frozen=True, eq=False)
class _Piece:
    """Connected area of ground outside polygons.

    Attributes:
        mask: its cells.
        low: world position of the corner of the mask (2,) [m].
        scale: scale of the mask [px/m].
        outside: whether it touches the border.
    """

    mask: pygame.Mask
    low: Array
    scale: float
    outside: bool

    @property
    def area(self) -> float:
        """Area [m2]."""
        return float(self.mask.count()) / self.scale**2

    @property
    def outline(self) -> Array:
        """Outline (n, 2) [m]."""
        return _outline(self.mask, self.low, self.scale)


def _free(outlines: Sequence[Array], scale: float, border: float) -> list[_Piece]:
    """Returns the areas outside polygons (n, 2) [m], within a frame extended by a border [m]."""
    surface, low = _painted(outlines, scale, border)
    free = pygame.mask.from_surface(surface)
    free.invert()
    frame = pygame.mask.Mask(surface.get_size(), fill=True)
    frame.erase(pygame.mask.Mask(np.maximum(np.array(surface.get_size()) - 2, 0).tolist(), fill=True), (1, 1))
    return [
        _Piece(mask, low, scale, mask.overlap(frame, (0, 0)) is not None)
        for mask in free.connected_components(minimum=1)
    ]


def junction_areas(town: Town) -> list[Array]:
    """Returns the outlines (n, 2) [m] of the asphalt of junctions: connectors, mouths, and the gaps between them.

    Gaps narrower than five metres and small holes are closed; larger holes, as in a roundabout, stay open.
    """
    return [outline for junction in town.junctions for outline in _closed(town, junction.connectors)]


def _closed(town: Town, connectors: Sequence[int]) -> Iterator[Array]:
    lanes = [town.lanes[k] for k in connectors]
    outlines = [ribbon(lane, -_INSET) for lane in lanes]
    for lane in dict.fromkeys(k for c in connectors for k in town.predecessors(c)):
        if not (mouth := town.lanes[lane]).in_junction:
            outlines.append(ribbon(mouth, -_INSET, max(0.0, mouth.length - _MOUTH)))
    for lane in dict.fromkeys(link.target for c in connectors for link in town.successors(c)):
        if not (mouth := town.lanes[lane]).in_junction:
            outlines.append(ribbon(mouth, -_INSET, 0.0, min(mouth.length, _MOUTH)))
    if not outlines:
        return
    surface, low = _painted(outlines, _HOLE_SCALE, 2.0 * _CLOSING)
    solid = pygame.surfarray.array_alpha(surface) > 0
    # Morphological closing: fills gaps narrower than twice the radius.
    radius = _CLOSING * _HOLE_SCALE
    grown = distance_transform_edt(~solid) <= radius
    solid |= distance_transform_edt(grown) > radius
    for hole in _pieces(~solid):
        if hole.mask.count() < _LARGEST_HOLE * _HOLE_SCALE**2 and not hole.outside:
            solid |= hole.array
    for piece in _pieces(solid):
        yield simplified(smooth_outline(_outline(piece.mask, low, _HOLE_SCALE), _OUTLINE_SMOOTHING), 0.03)


@dataclass(frozen=True, eq=False)
class _Part:
    """Connected part of a grid: as a mask, as cells (width, height), and whether it touches the edge."""

    mask: pygame.Mask
    array: NDArray[np.bool_]
    outside: bool


def _pieces(cells: NDArray[np.bool_]) -> Iterator[_Part]:
    numbers, count = label(cells)
    for k in range(1, count + 1):
        array = numbers == k
        rim = array[0].any() or array[-1].any() or array[:, 0].any() or array[:, -1].any()
        shown = pygame.Surface(array.shape, pygame.SRCALPHA, 32)
        alpha = pygame.surfarray.pixels_alpha(shown)
        alpha[:] = array * np.uint8(255)
        del alpha  # unlocks the surface
        yield _Part(pygame.mask.from_surface(shown), array, bool(rim))


def _outline(mask: pygame.Mask, low: Array, scale: float) -> Array:
    """Returns the outline (n, 2) [m] of a mask; a small disc if the mask is too small."""
    line = np.array(mask.outline(), dtype=float).reshape(-1, 2)
    if len(line) < 4:
        return disc(np.array(mask.centroid()) / scale + low, 1.0 / scale, 8)
    return np.asarray((line + 0.5) / scale + low)


def smooth_outline(outline: Array, size: int) -> Array:
    """Smooths the grid steps of a closed outline (n, 2) with a running mean over `size` points."""
    if len(outline) <= 2 * size:
        return outline
    around = np.concatenate((outline[-(size // 2) :], outline, outline[: size // 2]))
    kernel = np.full(size, 1.0 / size)
    return np.stack([np.convolve(around[:, k], kernel, mode="valid") for k in (0, 1)], axis=-1)


def _painted(outlines: Sequence[Array], scale: float, border: float) -> tuple[pygame.Surface, Array]:
    """Draws polygons (n, 2) [m] on a surface, extended by a border [m]; returns it and its corner (2,) [m]."""
    points = np.concatenate(outlines)
    low, high = points.min(axis=0) - border, points.max(axis=0) + border
    width, height = (int(n) for n in np.ceil((high - low) * scale))
    surface = pygame.Surface((width, height), pygame.SRCALPHA, 32)
    for outline in outlines:
        pygame.draw.polygon(surface, (255, 255, 255, 255), ((outline - low) * scale).tolist())
    return surface, low


def landscape(town: Town, border: float) -> list[Shape]:
    """Returns the ground between and around the streets: blocks, parks with trees, and country.

    The scenery is fictional and depends on the name of the town only; it has no effect on the simulation.

    Args:
        town: town to paint.
        border: width of the country beyond the streets [m].
    """
    pieces = _free([ribbon(lane, 0.5) for lane in town.lanes], _BLOCK_SCALE, border)
    rng = np.random.default_rng(zlib.crc32(town.name.encode()))
    inner = sorted((p for p in pieces if not p.outside and p.area > 12.0), key=lambda p: -p.area)
    shapes = []
    for rank, piece in enumerate(inner):
        # every third large block is a park; slivers (medians, islands) are grass
        park = piece.area < _SLIVER or (piece.area > _SMALLEST_PARK and rank % 3 == 1)
        colour = palette.PARK if park else palette.BLOCK
        outline = simplified(smooth_outline(piece.outline, 5), 0.3)
        shapes.append(Shape(outline, colour))
        # the grid is coarse: a broad rim covers the ground up to the edge of the road
        shapes += [Shape(part, colour) for part in strokes(np.concatenate((outline, outline[:1])), _RIM)]
        if park and piece.area > _SMALLEST_PARK:
            shapes += _trees(town, piece, rng, 0.8, palette.TREE)
    for piece in pieces:
        if piece.outside and piece.area > _SMALLEST_PARK:
            shapes += _trees(town, piece, rng, 0.3, palette.COUNTRY_TREE)
    return shapes


def _trees(town: Town, piece: _Piece, rng: np.random.Generator, share: float, colour: Colour) -> Iterator[Shape]:
    """Yields trees on a jittered grid inside an area, away from its edge and from landmark sites."""
    size = np.array(piece.mask.get_size())
    grid = np.stack(np.meshgrid(*(np.arange(0.0, n / piece.scale, _PARK_TREE_SPACING) for n in size)), axis=-1).reshape(
        -1, 2
    )
    centres = piece.low + grid + rng.uniform(-4.5, 4.5, grid.shape)
    radii = rng.uniform(1.6, 3.4, len(grid))
    wanted = rng.random(len(grid)) < share
    rings = centres[:, None] + (radii[:, None, None] + 5.0) * disc((0.0, 0.0), 1.0, 12)  # (n, 12, 2)
    pixels = ((rings - piece.low) * piece.scale).astype(int)
    inside = ((pixels >= 0) & (pixels < size)).all(axis=(1, 2))
    wanted &= inside
    for k in np.flatnonzero(wanted).tolist():
        wanted[k] = all(piece.mask.get_at(pixel) for pixel in pixels[k].tolist())
    for site in town.sites:
        wanted &= pn.hypot(*(centres - np.array(site.position)).T) > radii + 6.0
    for k in np.flatnonzero(wanted).tolist():
        yield Shape(disc(centres[k], float(radii[k])), colour)
