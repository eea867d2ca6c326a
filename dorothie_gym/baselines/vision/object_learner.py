"""Training and tests of a Deformable DETR on labelled pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from dorothie_gym.baselines.vision.detector import KINDS, Detector, DetectorConfig, Targets
from dorothie_gym.baselines.vision.frames import SPACE_COLUMNS, FrameSampling, FrameSet, Pictures
from dorothie_gym.baselines.vision.metrics import (
    PictureBoxes,
    average_precisions,
    best_threshold,
    distinct,
    place_precision,
    space_errors,
)
from dorothie_gym.baselines.vision.pixel_learner import labelled
from dorothie_gym.baselines.vision.solids import Focals, enlarged, mirrored, solids_of, spaces_of
from dorothie_gym.baselines.vision.training import Learner

LEAST_PIXELS: Final = 64
"""Visible pixels from which an object counts in tests; others are ignored."""

OVERLAP: Final = 0.5
"""Overlap above which boxes in a picture count as one object."""

TURNED: Final = (0, 1)
"""Rows of `KINDS` with meaningful headings: props look alike from several sides."""

VALIDATED: Final = 150
"""Maximum number of validation pictures after an epoch, evenly chosen."""

_TESTED: Final = 8  # pictures at once
_LEAST_SHARE: Final = 0.4  # of an object's box that an enlarged part of a picture must hold


class ObjectLearner(Learner):
    """Deformable DETR with its pictures; it reads their classes and depths, whether true or predicted."""

    clip: ClassVar[float] = 0.1

    def __init__(
        self, config: DetectorConfig, training: FrameSet, validation: FrameSet, seed: int, device: torch.device
    ) -> None:
        torch.manual_seed(seed)
        self.config: DetectorConfig = config
        self.model: Detector = Detector(config)
        self.model.to(device)
        self.device = device
        self._training, self._validation = training, validation

    @property
    def pictures(self) -> int:
        """Number of training pictures."""
        return len(self._training)

    def groups(self) -> list[tuple[list[nn.Parameter], float]]:
        """Returns the parameters of the backbone and all others, with the factors of their learning rates."""
        backbone = list(self.model.detr.model.backbone.parameters())
        inside = {id(parameter) for parameter in backbone}
        others = [parameter for parameter in self.model.parameters() if id(parameter) not in inside]
        return [(others, 1.0), (backbone, self.config.backbone_rate)]

    def loss(self, rows: Sequence[int], epoch: int) -> Tensor:
        """Returns the mean loss of the given training pictures, half of them mirrored, as enlarged crops."""
        pictures = self._training.take(rows)
        rgb, depth, semantic = inputs(pictures, self.device)
        images, wanted = [], []
        for k, boxes in enumerate(pictures.boxes):
            true = targets(boxes, self.config)
            window = _window(self.config.zoom)
            true = _in_part(true, window)
            part = _part(rgb[k], depth[k], semantic[k], window)
            if float(torch.rand(())) < 0.5:
                part, true = tuple(image.flip(-1) for image in part), _mirrored(true)
            images.append(part)
            wanted.append(true.to(self.device))
        colours, depths, classes = (torch.stack(column) for column in zip(*images, strict=True))
        return self.model.loss(colours, depths, classes, wanted)

    def validate(self) -> Mapping[str, float]:
        """Returns figures of the validation pictures, and the best score threshold of detections; the score is AP50."""
        found = detected_boxes(self.model, self._validation, most=VALIDATED)
        figures = object_figures(found)
        threshold, f1 = best_threshold(found)
        score = 0.0 if np.isnan(figures["ap50"]) else figures["ap50"]
        return {**figures, "threshold": threshold, "f1": f1, "score": score}


def inputs(pictures: Pictures, device: torch.device) -> tuple[Tensor, Tensor, Tensor]:
    """Returns RGB (b, 3, h, w) in [-1, 1], depths (b, h, w) [m] and classes (b, h, w) as tensors."""
    rgb, semantic, depth = labelled(pictures, device)
    return rgb, depth, semantic


def kinds_of(boxes: NDArray[np.void]) -> NDArray[np.int64]:
    """Returns the rows of `KINDS` of boxes (n,) of `BOX_DTYPE`; all props are of the last."""
    table = {kind.value: number for number, kind in enumerate(KINDS)}
    return np.array([table.get(kind, len(KINDS) - 1) for kind in boxes["kind"].tolist()], dtype=np.int64)


def focals_of(config: DetectorConfig) -> Focals:
    """Returns the focal lengths of the pictures of a detector."""
    return Focals.of(FrameSampling(width=config.width, height=config.height).camera)


def targets(boxes: NDArray[np.void], config: DetectorConfig) -> Targets:
    """Returns the objects in a picture that have enough visible pixels for training, from boxes of `BOX_DTYPE`."""
    chosen = boxes[boxes["pixels"] >= config.least_pixels]
    left, top, right, bottom = (chosen[name].astype(np.float32) for name in ("left", "top", "right", "bottom"))
    width, height = config.width, config.height
    columns = (left + right) / 2 / width, (top + bottom) / 2 / height, (right - left) / width, (bottom - top) / height
    solids, known = solids_of(chosen, focals_of(config))
    return Targets(
        torch.from_numpy(np.stack(columns, axis=1)),
        torch.from_numpy(kinds_of(chosen)),
        torch.from_numpy(solids),
        torch.from_numpy(known),
    )


def _window(zoom: float) -> tuple[float, float, float]:
    """Returns left and top of a random part of a picture, and its size, in shares of the picture."""
    if float(torch.rand(())) < 0.3:
        return 0.0, 0.0, 1.0
    size = zoom + (1.0 - zoom) * float(torch.rand(()))
    left, top = ((1.0 - size) * torch.rand(2)).tolist()
    return left, top, size


def _part(rgb: Tensor, depth: Tensor, semantic: Tensor, window: tuple[float, float, float]) -> tuple[Tensor, ...]:
    """Returns a part of a picture (3, h, w), its depths (h, w) and classes (h, w), enlarged to the whole size."""
    left, top, size = window
    if size == 1.0:
        return rgb, depth, semantic
    height, width = depth.shape
    rows = ((torch.arange(height) + 0.5) * size + top * height).long().clamp(0, height - 1).to(rgb.device)
    columns = ((torch.arange(width) + 0.5) * size + left * width).long().clamp(0, width - 1).to(rgb.device)
    pixels = rows[:, None] * width + columns  # the nearest, also in RGB
    return rgb.flatten(1)[:, pixels], depth.flatten()[pixels] * size, semantic.flatten()[pixels]


def _in_part(true: Targets, window: tuple[float, float, float]) -> Targets:
    """Returns the objects of a picture in an enlarged crop of it, without objects mostly outside the crop."""
    left, top, size = window
    boxes, corner = true.boxes, torch.tensor((left, top))
    low = (boxes[:, :2] - boxes[:, 2:] / 2 - corner) / size
    high = (boxes[:, :2] + boxes[:, 2:] / 2 - corner) / size
    whole = (high - low).prod(1)
    low, high = low.clamp(0.0, 1.0), high.clamp(0.0, 1.0)
    kept = (high - low).prod(1) > _LEAST_SHARE * whole
    inside = torch.cat(((low + high) / 2, high - low), 1)
    return replace(true, boxes=inside, solids=enlarged(true.solids, left, top, size)).of(kept)


def _mirrored(true: Targets) -> Targets:
    """Returns the objects of a mirrored picture."""
    boxes = torch.cat((1.0 - true.boxes[:, :1], true.boxes[:, 1:]), 1)
    return replace(true, boxes=boxes, solids=mirrored(true.solids))


# --- Tests ------------------------------------------------------------------------------------------------------------


def detected_boxes(model: Detector, pictures: FrameSet, *, most: int | None = None) -> list[PictureBoxes]:
    """Returns the true and the detected boxes of pictures, or of at most a given number, evenly chosen."""
    model.eval()
    where = next(model.parameters()).device
    count = min(len(pictures), most or len(pictures))
    rows = (np.arange(count) * len(pictures) // max(count, 1)).tolist()
    found = []
    for start in range(0, count, _TESTED):
        batch = pictures.take(rows[start : start + _TESTED])
        with torch.inference_mode():
            detections = model(*inputs(batch, where))
        height, width = batch.semantic.shape[1:]
        scale = np.array((width, height, width, height), dtype=np.float64)
        parts = (detections.boxes, detections.scores, detections.solids)
        for boxes, centred, scores, solids in zip(batch.boxes, *(part.cpu().numpy() for part in parts), strict=True):
            found.append(_compared(boxes, centred, scores, solids, scale, focals_of(model.config)))
    return found


def distinct_queries(centred: NDArray[np.floating], scores: NDArray[np.floating]) -> NDArray[np.int64]:
    """Returns the queries (n,) that overlap no query with a higher score by more than `OVERLAP`, best first.

    Args:
        centred: (q, 4) boxes: centre x and y, width and height.
        scores: (q, k) sureness of the kinds.
    """
    return distinct(corners_of(centred).astype(np.float64), scores.max(axis=1).astype(np.float64), OVERLAP)


def corners_of(centred: NDArray[np.floating]) -> NDArray[np.floating]:
    """Returns left, top, right and bottom (n, 4) of boxes (n, 4) with centre x and y, width and height."""
    half = centred[:, 2:] / 2
    return np.concatenate((centred[:, :2] - half, centred[:, :2] + half), axis=1)


def _compared(
    boxes: NDArray[np.void],
    centred: NDArray[np.float32],
    scores: NDArray[np.float32],
    solids: NDArray[np.float32],
    scale: NDArray[np.float64],
    focals: Focals,
) -> PictureBoxes:
    """Returns the true and the detected boxes of a picture, each found once; a query may be of any kind."""
    chosen = distinct_queries(centred, scores)
    centred, scores, solids = centred[chosen], scores[chosen], solids[chosen]
    return PictureBoxes(
        true=np.stack([boxes[name] for name in ("left", "top", "right", "bottom")], axis=1).astype(np.float64),
        kinds=kinds_of(boxes),
        ignored=boxes["pixels"] < LEAST_PIXELS,
        spaces=np.stack([boxes[name] for name in SPACE_COLUMNS], axis=1).astype(np.float64),
        detected=np.repeat(corners_of(centred) * scale, len(KINDS), axis=0),
        detected_kinds=np.tile(np.arange(len(KINDS)), len(centred)),
        scores=scores.astype(np.float64).ravel(),
        detected_spaces=np.repeat(spaces_of(solids, focals), len(KINDS), axis=0),
    )


def object_figures(pictures: Sequence[PictureBoxes]) -> dict[str, float]:
    """Returns AP50 and AP50:95 over the kinds with a true box, AP50 of each kind, and the number of true boxes.

    Of the boxes in space: average precision by places, and the mean errors, see `metrics`.
    """
    precisions = average_precisions(pictures)
    figures = {
        "ap50": float(precisions[0]),
        "ap50_95": float(precisions.mean()),
        "ap_place": place_precision(pictures),
        **space_errors(pictures, turned=TURNED),
    }
    for number, kind in enumerate(KINDS):
        single = [picture.of_kind(number) for picture in pictures]
        figures[f"ap50_{kind.name.lower()}"] = float(average_precisions(single, (0.5,))[0])
        figures[f"boxes_{kind.name.lower()}"] = float(sum(int((~picture.ignored).sum()) for picture in single))
    return figures
