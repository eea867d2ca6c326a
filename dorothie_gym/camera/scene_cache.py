"""Cache of the scenes of towns: one `.npz` archive for each town, in the folder `scenes` of the user's cache."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import io
import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray

from dorothie_gym.camera.cells import CellTable
from dorothie_gym.camera.ground.lookup import GroundArrays
from dorothie_gym.camera.ground.town_ground import Ground
from dorothie_gym.camera.lighting import LampMap
from dorothie_gym.camera.mesh import Mesh
from dorothie_gym.camera.road_slopes import RoadSlopes
from dorothie_gym.camera.scenery.clearance import Lot
from dorothie_gym.camera.scenery.signals import Lenses
from dorothie_gym.camera.town_scene import TownScene, build_town_scene
from dorothie_gym.maps.cache import compiler_digest, pack, package_sources, remove_oldest
from dorothie_gym.maps.town import Town
from dorothie_gym.user_cache import cache_folder, read_signed, write_signed

SCENES_KEPT = 16
"""Largest number of entries; the oldest are removed beyond it. A scene takes 10 to 30 MB."""

_PACKAGES = ("dorothie_gym.camera", "dorothie_gym.rendering", "dorothie_gym.sim")
_log = logging.getLogger(__name__)


Table = TypeVar("Table", bound=tuple[NDArray[Any], ...])


@functools.lru_cache(maxsize=4)
def town_scene(town: Town) -> TownScene:
    """Returns the scene of a town, from memory or the user's cache, or built now.

    A cache that cannot be read or written is logged at level DEBUG and otherwise ignored.
    """
    entry = _entry(town)
    scene = None if entry is None else _recall(entry, town)
    if scene is None:
        scene = build_town_scene(town)
        if entry is not None:
            _keep(entry, scene)
    return scene


def pack_scene(scene: TownScene) -> bytes:
    """Returns the arrays of a scene as the bytes of an `.npz` file."""
    arrays = {
        **_columns("mesh", scene.mesh), **_columns("cells", scene.cells), **_columns("ground", scene.ground.arrays),
        **_columns("signals", scene.signals), **_columns("lenses", scene.lenses), **_columns("lamps", scene.lamps),
        **_columns("slopes", scene.slopes),
    }  # fmt: skip
    lots = [(lot.site, *lot.place, lot.heading, *lot.front, lot.length, lot.depth) for lot in scene.lots]
    buffer = io.BytesIO()
    np.savez(buffer, lots=np.array(lots, dtype=np.float64).reshape(-1, 8), **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def unpack_scene(data: bytes, town: Town) -> TownScene:
    """Returns the scene of a town from what `pack_scene` has written.

    Raises:
        KeyError, OSError, ValueError: the bytes hold no scene.
    """
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        arrays: dict[str, NDArray[Any]] = {name: archive[name] for name in archive.files}
    mesh = _table(arrays, "mesh", Mesh)
    lots = tuple(
        Lot(int(site), (x, y), heading, (front_x, front_y), length, depth)
        for site, x, y, heading, front_x, front_y, length, depth in arrays["lots"].tolist()
    )
    return TownScene(
        ground=Ground(mesh, _table(arrays, "ground", GroundArrays)),
        mesh=mesh,
        cells=_table(arrays, "cells", CellTable),
        signals=_table(arrays, "signals", Mesh),
        lenses=_table(arrays, "lenses", Lenses),
        lamps=_table(arrays, "lamps", LampMap),
        slopes=_table(arrays, "slopes", RoadSlopes),
        lots=lots,
        programmes=tuple(town.programmes),
    )


def _columns(name: str, table: tuple[NDArray[Any], ...]) -> dict[str, NDArray[Any]]:
    """Returns the arrays of a named tuple by their names in an archive."""
    fields: tuple[str, ...] = vars(type(table))["_fields"]
    return {f"{name}.{field}": column for field, column in zip(fields, table, strict=True)}


def _table(arrays: Mapping[str, NDArray[Any]], name: str, kind: Callable[..., Table]) -> Table:
    """Returns a named tuple of arrays of an archive."""
    fields: tuple[str, ...] = vars(kind)["_fields"]
    return kind(*(arrays[f"{name}.{field}"] for field in fields))


@functools.cache
def builder_digest() -> str | None:
    """Returns a digest of everything besides the town that determines its scene; None if it cannot be read."""
    compiler = compiler_digest()
    if compiler is None:
        return None
    versions = [importlib.metadata.version(name) for name in ("highway-env", "pillow", "shapely")]
    digest = hashlib.sha256(f"{compiler} {versions} {shapely.geos_version_string}\n".encode())
    for package in _PACKAGES:
        for name, text in package_sources(package):
            digest.update(f"{package} {name} {len(text)}\n".encode() + text)
    return digest.hexdigest()


def _entry(town: Town) -> Path | None:
    """Returns the file of a town's scene, which need not exist; None if caching is turned off."""
    cache, builder = cache_folder(), builder_digest()
    if cache is None or builder is None:
        return None
    key = hashlib.sha256(builder.encode() + pack(town, "")).hexdigest()
    return cache / "scenes" / f"{key}.npz"


def _recall(entry: Path, town: Town) -> TownScene | None:
    try:
        data = read_signed(entry)
        return None if data is None else unpack_scene(data, town)
    except FileNotFoundError:
        return None
    except (KeyError, OSError, ValueError) as error:
        _log.debug("the cached scene %s cannot be used and is built again: %s", entry, error)
        return None


def _keep(entry: Path, scene: TownScene) -> None:
    try:
        write_signed(entry, pack_scene(scene))
        remove_oldest(entry.parent, SCENES_KEPT)
    except OSError as error:
        _log.debug("the scene %s cannot be kept: %s", entry, error)
