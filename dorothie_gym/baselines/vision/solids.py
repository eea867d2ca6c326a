"""Boxes in space from pictures, in the usual numbers of monocular detection.

A picture shows the position of a box's centre, its distance, its size, and its rotation relative to the viewer
(Mousavian et al., CVPR 2017; Simonelli et al., ICCV 2019). Solids have these as columns: the projected centre x and y,
in widths and heights of the picture, logarithms of depth, length, width and height [m], and sine and cosine of the
heading relative to the ray through the centre. They change simply with the picture: mirroring turns the sign of the
sine, and an enlarged part looks like the same scene nearer by, its depths multiplied by the part's share of the
picture.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from dorothie_gym.baselines.vision.frames import SPACE_COLUMNS
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.session.config import CameraConfig

SOLID: Final = 8
"""Number of columns of a solid."""

NEAREST_MIDDLE: Final = 1.0
"""Smallest depth of a box's centre that is projected [m]."""

_LEAST_SIDE: Final = 0.02  # of a box in the picture, by which its centre's offset is measured


class Focals(NamedTuple):
    """Focal lengths of a camera in widths and in heights of its picture."""

    x: float
    y: float

    @classmethod
    def of(cls, config: CameraConfig) -> Focals:
        """Returns those of a camera."""
        x = 0.5 / float(np.tan(np.radians(config.field_of_view) / 2.0))
        return cls(x, x * config.width / config.height)


def solids_of(boxes: NDArray[np.void], focals: Focals) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Returns the solids (n, 8) of boxes (n,) of `BOX_DTYPE`, and whether their centres can be projected (n,).

    The first are meaningless where the second are False: where the centre is beside or behind the camera.
    """
    x, y, z, length, width, height, heading = (boxes[name].astype(np.float64) for name in SPACE_COLUMNS)
    known, depth = z >= NEAREST_MIDDLE, np.maximum(z, NEAREST_MIDDLE)
    turned = heading - np.arctan2(x, depth)
    columns = (
        0.5 + focals.x * x / depth,
        0.5 + focals.y * y / depth,
        np.log(depth),
        np.log(length),
        np.log(width),
        np.log(height),
        np.sin(turned),
        np.cos(turned),
    )
    return np.stack(columns, axis=1).astype(np.float32), known


def spaces_of(solids: NDArray[np.floating], focals: Focals) -> NDArray[np.float64]:
    """Returns the `SPACE_COLUMNS` (..., 7) of solids (..., 8)."""
    u, v, depth, length, width, height, sine, cosine = np.moveaxis(solids.astype(np.float64), -1, 0)
    z = np.exp(depth)
    x, y = (u - 0.5) * z / focals.x, (v - 0.5) * z / focals.y
    heading = wrap_radians(np.arctan2(sine, cosine) + np.arctan2(x, z))
    return np.stack((x, y, z, np.exp(length), np.exp(width), np.exp(height), heading), axis=-1)


def solids_from(boxes: Tensor, raw: Tensor) -> Tensor:
    """Returns the solids (..., 8) that a head predicts in addition to boxes in the picture.

    Args:
        boxes: (..., 4) centre, width and height, in shares of the picture.
        raw: (..., 8) outputs of the head: as solids, but the projected centre is relative to that of the box, in its
            widths and heights.
    """
    middles = boxes[..., :2] + raw[..., :2] * boxes[..., 2:].clamp(min=_LEAST_SIDE)
    return torch.cat((middles, raw[..., 2:]), -1)


def solid_loss(found: Tensor, true: Tensor, boxes: Tensor) -> Tensor:
    """Returns the mean absolute error of solids (n, 8), summed over columns; 0 for none.

    Args:
        found: (n, 8) predicted.
        true: (n, 8).
        boxes: (n, 4) true boxes in the picture, whose widths and heights are the units of the centre's error.
    """
    errors = (found - true).abs()
    units = boxes[:, 2:].clamp(min=_LEAST_SIDE)
    total = (errors[:, :2] / units).sum() + errors[:, 2:].sum()
    return total / max(len(true), 1)


def mirrored(solids: Tensor) -> Tensor:
    """Returns the solids (n, 8) of a mirrored picture."""
    changed = solids.clone()
    changed[:, 0] = 1.0 - solids[:, 0]
    changed[:, 6] = -solids[:, 6]
    return changed


def enlarged(solids: Tensor, left: float, top: float, size: float) -> Tensor:
    """Returns the solids (n, 8) in a part of a picture that is enlarged to the whole.

    Args:
        solids: in the whole picture.
        left: edge of the part, in shares of the picture.
        top: edge of the part.
        size: width and height of the part.
    """
    changed = solids.clone()
    changed[:, 0] = (solids[:, 0] - left) / size
    changed[:, 1] = (solids[:, 1] - top) / size
    changed[:, 2] = solids[:, 2] + float(np.log(size))
    return changed
