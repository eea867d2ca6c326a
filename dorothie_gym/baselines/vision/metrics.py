"""Metrics of the vision models: intersection over union, errors of depth, and COCO's average precision.

Classes present are those with at least one true pixel in the pictures that are tested; the means over classes are over
these. Objects are tested class by class as in COCO: a detection is right if its box overlaps one of the picture's true
boxes of its class, not found by a surer detection, by at least a share of their union. Precision is read at 101 values
of recall. True boxes with few visible pixels are ignored: they need not be found, and detections of them do not count.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.vision.frames import CLASSES
from dorothie_gym.ontology import ObjectClass

Array = NDArray[np.float64]

DEPTH_RANGE: Final = 80.0
"""Largest true depth of a pixel whose error counts [m]."""

OVERLAPS: Final = tuple(round(0.5 + 0.05 * k, 2) for k in range(10))
"""COCO's thresholds of overlap."""

_RECALLS: Final = np.linspace(0.0, 1.0, 101)


class PixelScores:
    """Confusion of classes, and errors of depth, summed over pictures."""

    def __init__(self) -> None:
        self.confusion = np.zeros((CLASSES, CLASSES), dtype=np.int64)
        self._error, self._pixels = 0.0, 0

    def add(
        self,
        semantic: NDArray[np.integer],
        predicted: NDArray[np.integer],
        depth: NDArray[np.floating],
        estimated: NDArray[np.floating],
    ) -> None:
        """Adds true and predicted classes (..., h, w), and true and estimated depths (..., h, w) [m]."""
        pairs = semantic.astype(np.int64).ravel() * CLASSES + predicted.astype(np.int64).ravel()
        self.confusion += np.bincount(pairs, minlength=CLASSES * CLASSES).reshape(CLASSES, CLASSES)
        near = depth <= DEPTH_RANGE
        true = depth[near].astype(np.float64)
        self._error += float((np.abs(estimated[near] - true) / true).sum())
        self._pixels += len(true)

    @property
    def overlaps(self) -> Mapping[ObjectClass, float]:
        """Intersection over union of each class present."""
        right, true, found = np.diag(self.confusion), self.confusion.sum(1), self.confusion.sum(0)
        return {
            kind: float(right[kind.value] / (true[kind.value] + found[kind.value] - right[kind.value]))
            for kind in ObjectClass
            if kind.value < CLASSES and true[kind.value]
        }

    def figures(self) -> dict[str, float]:
        """Returns mIoU, mAcc (mean recall of the classes present), aAcc (share of right pixels) and depth error."""
        right, true = np.diag(self.confusion), self.confusion.sum(1)
        present = true > 0
        if not present.any():
            return dict.fromkeys(("miou", "macc", "aacc", "depth_error"), math.nan)
        return {
            "miou": float(np.mean(list(self.overlaps.values()))),
            "macc": float((right[present] / true[present]).mean()),
            "aacc": float(right.sum() / true.sum()),
            "depth_error": self._error / self._pixels if self._pixels else math.nan,
        }


# --- Objects ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class PictureBoxes:
    """True and detected boxes of a picture: left, top, right, bottom in any unit.

    Attributes:
        true: (n, 4).
        kinds: (n,) classes.
        ignored: (n,) bool, whether a true box is ignored.
        detected: (m, 4).
        detected_kinds: (m,) classes.
        scores: (m,) sureness.
    """

    true: Array
    kinds: NDArray[np.int64]
    ignored: NDArray[np.bool_]
    detected: Array
    detected_kinds: NDArray[np.int64]
    scores: Array


def average_precisions(pictures: Sequence[PictureBoxes], overlaps: Sequence[float] = OVERLAPS) -> Array:
    """Returns the average precision (k,) at each overlap, mean over the classes that have a true box; NaN for none."""
    kinds = sorted({int(kind) for picture in pictures for kind in picture.kinds[~picture.ignored]})
    if not kinds:
        return np.full(len(overlaps), math.nan)
    return np.asarray(np.mean([_of_kind(pictures, kind, overlaps) for kind in kinds], axis=0))


def _of_kind(pictures: Sequence[PictureBoxes], kind: int, overlaps: Sequence[float]) -> Array:
    """Returns the average precision (k,) of a class at each overlap."""
    scores, right, counted, wanted = [], [], [], 0
    for picture in pictures:
        true, found = picture.kinds == kind, picture.detected_kinds == kind
        order = np.argsort(-picture.scores[found], kind="stable")
        boxes, ignored = picture.true[true], picture.ignored[true]
        wanted += int((~ignored).sum())
        shares = box_overlaps(picture.detected[found][order], boxes)
        hit, counts = _matched(shares, ignored, np.asarray(overlaps))
        scores.append(picture.scores[found][order])
        right.append(hit)
        counted.append(counts)
    order = np.argsort(-np.concatenate(scores), kind="stable")
    hits, counts = np.concatenate(right, axis=1)[:, order], np.concatenate(counted, axis=1)[:, order]
    return np.array([_precision(hit[count], wanted) for hit, count in zip(hits, counts, strict=True)])


def _matched(shares: Array, ignored: NDArray[np.bool_], overlaps: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Returns whether each detection (k, m), the surest first, is right at each overlap, and whether it counts."""
    hit = np.zeros((len(overlaps), len(shares)), dtype=np.bool_)
    counts = np.ones_like(hit)
    for row, least in enumerate(overlaps):
        free = np.ones(len(ignored), dtype=np.bool_)
        for number, share in enumerate(shares):
            fits = (share >= least) & free
            wanted = np.flatnonzero(fits & ~ignored)
            if len(wanted):
                best = wanted[np.argmax(share[wanted])]
                free[best], hit[row, number] = False, True
            elif (fits & ignored).any():  # several detections may cover a box that is ignored
                counts[row, number] = False
    return hit, counts


def _precision(hit: NDArray[np.bool_], wanted: int) -> float:
    """Returns the mean over 101 recalls of the highest precision at that recall or a larger one."""
    found = np.cumsum(hit)
    recall, precision = found / wanted, found / np.arange(1, len(hit) + 1)
    highest = np.maximum.accumulate(precision[::-1])[::-1]
    place = np.searchsorted(recall, _RECALLS, side="left")
    return float(np.where(place < len(highest), np.append(highest, 0.0)[np.minimum(place, len(highest))], 0.0).mean())


def box_overlaps(first: Array, second: Array) -> Array:
    """Returns intersection over union (m, n) of boxes (m, 4) and (n, 4): left, top, right, bottom."""
    low = np.maximum(first[:, None, :2], second[None, :, :2])
    high = np.minimum(first[:, None, 2:], second[None, :, 2:])
    common = np.prod(np.clip(high - low, 0.0, None), axis=2)
    areas = [np.prod(np.clip(boxes[:, 2:] - boxes[:, :2], 0.0, None), axis=1) for boxes in (first, second)]
    union = areas[0][:, None] + areas[1][None] - common
    return np.asarray(common / np.where(union > 0.0, union, 1.0))
