"""Metrics of the vision models: intersection over union, errors of depth, and COCO's average precision.

Classes present are those with at least one true pixel in the tested pictures; the means over classes are over
these. Objects are tested class by class as in COCO: a detection is correct if its box overlaps one of the picture's
true boxes of its class by at least a share of their union, and no detection with a higher score has matched this box.
Precision is read at 101 values of recall. True boxes with few visible pixels are ignored: they need not be found, and
detections of them do not count.

Boxes in space are tested like nuScenes (Caesar et al., CVPR 2020): average precision where a detection is correct if
its centre is at most 2 m from a true one, ignoring height, and mean errors of the detections that are correct by
overlap.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.vision.frames import CLASSES
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.support.portable_math import wrap_radians

Array = NDArray[np.float64]

DEPTH_RANGE: Final = 80.0
"""Largest true depth of a pixel whose error counts [m]."""

OVERLAPS: Final = tuple(round(0.5 + 0.05 * k, 2) for k in range(10))
"""COCO's thresholds of overlap."""

PLACE_RADIUS: Final = 2.0
"""Largest distance of the centres of a true and a detected box in space that belong together [m]."""

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
        """Returns mIoU, mAcc (mean recall of the classes present), aAcc (share of correct pixels) and depth error."""
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
        spaces: (n, 7) boxes in space, `SPACE_COLUMNS`.
        detected: (m, 4).
        detected_kinds: (m,) classes.
        scores: (m,) sureness.
        detected_spaces: (m, 7) boxes in space.
    """

    true: Array
    kinds: NDArray[np.int64]
    ignored: NDArray[np.bool_]
    spaces: Array
    detected: Array
    detected_kinds: NDArray[np.int64]
    scores: Array
    detected_spaces: Array

    def of_kind(self, kind: int) -> PictureBoxes:
        """Returns the boxes of one kind, those with the highest score first."""
        true, found = self.kinds == kind, np.flatnonzero(self.detected_kinds == kind)
        found = found[np.argsort(-self.scores[found], kind="stable")]
        return PictureBoxes(
            self.true[true],
            self.kinds[true],
            self.ignored[true],
            self.spaces[true],
            self.detected[found],
            self.detected_kinds[found],
            self.scores[found],
            self.detected_spaces[found],
        )


Closeness: TypeAlias = Callable[[PictureBoxes], Array]
"""Returns the closeness of each detected box to each true one (m, n)."""


def _overlap(picture: PictureBoxes) -> Array:
    return box_overlaps(picture.detected, picture.true)


def _nearness(picture: PictureBoxes) -> Array:
    """Returns the negative distances of the centres, height aside (m, n) [m]."""
    x, _, z = (picture.detected_spaces[:, None, :3] - picture.spaces[None, :, :3]).transpose(2, 0, 1)
    return np.asarray(-np.hypot(x, z))


def average_precisions(
    pictures: Sequence[PictureBoxes], overlaps: Sequence[float] = OVERLAPS, closeness: Closeness = _overlap
) -> Array:
    """Returns the average precision (k,) at each overlap, mean over the classes that have a true box; NaN for none."""
    kinds = _kinds_of(pictures)
    if not kinds:
        return np.full(len(overlaps), math.nan)
    return np.asarray(np.mean([_of_kind(pictures, kind, overlaps, closeness) for kind in kinds], axis=0))


def place_precision(pictures: Sequence[PictureBoxes]) -> float:
    """Returns the average precision by places, mean over the classes that have a true box; NaN for none."""
    return float(average_precisions(pictures, (-PLACE_RADIUS,), _nearness)[0])


def space_errors(pictures: Sequence[PictureBoxes], turned: Sequence[int]) -> dict[str, float]:
    """Returns the mean errors of boxes in space whose boxes in the picture are right at an overlap of one half.

    Args:
        pictures: boxes of each picture.
        turned: kinds whose headings are compared.

    Returns:
        place_error: distance of the centres, height aside [m].
        range_error: |detected - true| / true depth.
        size_error: 1 minus the intersection over union of the boxes with aligned centre and heading.
        heading_error: [degrees].
        axis_error: the same if front and back are not distinguished [degrees].
        NaN where no box is right.
    """
    rows: dict[str, list[Array]] = {name: [] for name in ("place", "range", "size", "heading", "axis")}
    for kind in _kinds_of(pictures):
        for picture in (each.of_kind(kind) for each in pictures):
            partner = _partners(_overlap(picture), picture.ignored, 0.5)
            found, true = picture.detected_spaces[partner >= 0], picture.spaces[partner[partner >= 0]]
            rows["place"].append(np.hypot(found[:, 0] - true[:, 0], found[:, 2] - true[:, 2]))
            rows["range"].append(np.abs(found[:, 2] - true[:, 2]) / np.maximum(true[:, 2], 1.0))
            common = np.prod(np.minimum(found[:, 3:6], true[:, 3:6]), axis=1)
            rows["size"].append(1.0 - common / (found[:, 3:6].prod(1) + true[:, 3:6].prod(1) - common))
            if kind in turned:
                rows["heading"].append(np.abs(np.degrees(wrap_radians(found[:, 6] - true[:, 6]))))
                rows["axis"].append(np.minimum(rows["heading"][-1], 180.0 - rows["heading"][-1]))
    every = {name: np.concatenate(parts) if parts else np.empty(0) for name, parts in rows.items()}
    return {f"{name}_error": float(values.mean()) if len(values) else math.nan for name, values in every.items()}


def best_threshold(pictures: Sequence[PictureBoxes]) -> tuple[float, float]:
    """Returns the score threshold with the highest F1 at an overlap of one half, and that F1; or (1, 0).

    Precision and recall are over the boxes of all classes.
    """
    scores, right, wanted = [np.empty(0)], [np.empty(0, dtype=np.bool_)], 0
    for kind in _kinds_of(pictures):
        for picture in (each.of_kind(kind) for each in pictures):
            wanted += int((~picture.ignored).sum())
            partner = _partners(_overlap(picture), picture.ignored, 0.5)
            counts = partner > _OF_IGNORED
            scores.append(picture.scores[counts])
            right.append(partner[counts] >= 0)
    score, hit = np.concatenate(scores), np.concatenate(right)
    if not hit.any():
        return 1.0, 0.0
    order = np.argsort(-score, kind="stable")
    score, found = score[order], np.cumsum(hit[order])
    last = np.append(score[1:] < score[:-1], True)  # a threshold takes all detections of a score
    f1 = np.where(last, 2.0 * found / (np.arange(1, len(score) + 1) + wanted), 0.0)
    best = int(np.argmax(f1))
    return float(score[best]), float(f1[best])


def _kinds_of(pictures: Sequence[PictureBoxes]) -> list[int]:
    """Returns the classes that have a true box, ascending."""
    return sorted({int(kind) for picture in pictures for kind in picture.kinds[~picture.ignored]})


def _of_kind(pictures: Sequence[PictureBoxes], kind: int, least: Sequence[float], closeness: Closeness) -> Array:
    """Returns the average precision (k,) of a class at each closeness threshold."""
    scores, right, counted, wanted = [], [], [], 0
    for picture in (each.of_kind(kind) for each in pictures):
        wanted += int((~picture.ignored).sum())
        hit, counts = _matched(closeness(picture), picture.ignored, np.asarray(least))
        scores.append(picture.scores)
        right.append(hit)
        counted.append(counts)
    order = np.argsort(-np.concatenate(scores), kind="stable")
    hits, counts = np.concatenate(right, axis=1)[:, order], np.concatenate(counted, axis=1)[:, order]
    return np.array([_precision(hit[count], wanted) for hit, count in zip(hits, counts, strict=True)])


def _matched(shares: Array, ignored: NDArray[np.bool_], least: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Returns whether each detection (k, m), in order of confidence, is correct at each closeness, and counts."""
    partners = np.array([_partners(shares, ignored, each) for each in least.tolist()]).reshape(len(least), len(shares))
    return partners >= 0, partners > _OF_IGNORED


_NOBODY: Final = -1
_OF_IGNORED: Final = -2


def _partners(shares: Array, ignored: NDArray[np.bool_], least: float) -> NDArray[np.int64]:
    """Returns the true box of each detection (m,), in order of confidence; or `_NOBODY`, or `_OF_IGNORED`."""
    partners = np.full(len(shares), _NOBODY, dtype=np.int64)
    free = np.ones(len(ignored), dtype=np.bool_)
    for number in np.flatnonzero((shares >= least).any(axis=1)).tolist():
        fits = (shares[number] >= least) & free
        wanted = np.flatnonzero(fits & ~ignored)
        if len(wanted):
            partners[number] = wanted[np.argmax(shares[number, wanted])]
            free[partners[number]] = False
        elif (fits & ignored).any():  # several detections may cover a box that is ignored
            partners[number] = _OF_IGNORED
    return partners


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


def distinct(boxes: Array, scores: Array, overlap: float) -> NDArray[np.int64]:
    """Returns the rows of boxes (n, 4) that overlap no box with a higher score by more than a share, best first.

    This is greedy suppression (Dalal and Triggs, CVPR 2005): a detector may find an object by several queries.
    """
    chosen: list[int] = []
    shares = box_overlaps(boxes, boxes)
    for row in np.argsort(-scores, kind="stable").tolist():
        if not chosen or shares[row, chosen].max() <= overlap:
            chosen.append(row)
    return np.array(chosen, dtype=np.int64)
