"""3D boxes of bodies: around their models, upright, along their headings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.compilation.records import RecordArray, plain

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.models.model_bank import ModelBank, PlacementRecord


@dataclass(frozen=True)
class SolidBoxes:
    """3D boxes of bodies.

    Attributes:
        keys: (n,) int32 key of each body.
        centres: (n, 3) [m].
        sizes: (n, 3) length, width and height [m].
        headings: (n,) [rad].
    """

    keys: NDArray[np.int32]
    centres: Array
    sizes: Array
    headings: Array


def solid_boxes(bank: ModelBank, placed: RecordArray[PlacementRecord]) -> SolidBoxes:
    """Returns the boxes of bodies.

    Args:
        bank: models.
        placed: models and places of the bodies.
    """
    bodies = plain(placed)
    low, high = bank.boxes[bodies["model"]].astype(np.float64).transpose(1, 0, 2)  # each (n, 3)
    ahead, aside, up = ((low + high) / 2.0).T
    cos, sin = bodies["cos"], bodies["sin"]
    centres = np.column_stack(
        (bodies["x"] + ahead * cos - aside * sin, bodies["y"] + ahead * sin + aside * cos, bodies["z"] + up)
    )
    return SolidBoxes(bodies["key"].copy(), centres, high - low, pn.arctan2(sin, cos))
