"""Textures and models that are the same in every town, kept in the user's cache."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.array_cache import Arrays, columns, table_of, through_cache
from dorothie_gym.pictures.camera.atlas import AtlasArrays, street_atlas
from dorothie_gym.pictures.camera.mesh import Mesh
from dorothie_gym.pictures.camera.models.model_bank import ModelBank, model_bank
from dorothie_gym.pictures.camera.models.props import warn_of_plain_props
from dorothie_gym.pictures.camera.sky import sky_noise
from dorothie_gym.support.copying import shared

ASSETS_KEPT = 4
"""Maximum number of entries, of different versions of the package; one takes 6 MB."""


@shared
@dataclass(frozen=True, eq=False)
class CameraAssets:
    """Camera data that all towns share.

    Attributes:
        atlas: textures, with the blades of all street names of the ontology.
        bank: models of bodies.
        noise: noise of the sky.
    """

    atlas: AtlasArrays
    bank: ModelBank
    noise: NDArray[np.float32]


@lru_cache(maxsize=1)
def camera_assets() -> CameraAssets:
    """Returns the textures and models of every town, from memory or the user's cache, or made now."""
    warn_of_plain_props()  # here, once in a process: models from the cache are not built
    return through_cache("assets", b"", ASSETS_KEPT, build=_build, pack=_pack, unpack=_unpack)


def _build() -> CameraAssets:
    return CameraAssets(street_atlas(), model_bank(), sky_noise())


def _pack(assets: CameraAssets) -> Arrays:
    bank = assets.bank
    return {
        **columns("atlas", assets.atlas),
        **columns("mesh", bank.mesh),
        "ranges": bank.ranges,
        "boxes": bank.boxes,
        "noise": assets.noise,
    }


def _unpack(arrays: Arrays) -> CameraAssets:
    bank = ModelBank(table_of(arrays, "mesh", Mesh), arrays["ranges"], arrays["boxes"])
    return CameraAssets(table_of(arrays, "atlas", AtlasArrays), bank, arrays["noise"])
