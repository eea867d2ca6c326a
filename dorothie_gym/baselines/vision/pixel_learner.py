"""Training and tests of a SegFormer on labelled pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F

from dorothie_gym.baselines.vision.metrics import PixelScores
from dorothie_gym.baselines.vision.segformer import SegFormer, SegFormerConfig, normalised
from dorothie_gym.baselines.vision.training import Learner

if TYPE_CHECKING:
    from dorothie_gym.baselines.vision.frames import FrameSet, Pictures

VALIDATED: Final = 120
"""Maximum number of validation pictures after an epoch, evenly chosen."""

_JITTER: Final = 0.2  # largest change of brightness and contrast
_TESTED: Final = 8  # pictures at once


class PixelLearner(Learner):
    """SegFormer with its pictures."""

    def __init__(
        self, config: SegFormerConfig, training: FrameSet, validation: FrameSet, seed: int, device: torch.device
    ) -> None:
        torch.manual_seed(seed)
        self.config: SegFormerConfig = config
        self.model: SegFormer = SegFormer(config, torch.from_numpy(training.pixel_counts).double())
        self.model.to(device)
        self.device = device
        self._training, self._validation = training, validation

    @property
    def pictures(self) -> int:
        """Number of training pictures."""
        return len(self._training)

    def loss(self, rows: Sequence[int], epoch: int) -> Tensor:
        """Returns the mean loss of the given training pictures, half of them mirrored."""
        rgb, semantic, depth = labelled(self._training.take(rows), self.device)
        if epoch < self.config.coarse_epochs:
            rgb, semantic, depth = F.avg_pool2d(rgb, 2), semantic[:, ::2, ::2], depth[:, ::2, ::2]
        mirrored = (torch.rand(len(rows)) < 0.5).to(self.device)
        rgb = torch.where(mirrored[:, None, None, None], rgb.flip(-1), rgb)
        semantic = torch.where(mirrored[:, None, None], semantic.flip(-1), semantic)
        depth = torch.where(mirrored[:, None, None], depth.flip(-1), depth)
        change = (1.0 + _JITTER * (2.0 * torch.rand(2, len(rows), 1, 1, 1) - 1.0)).to(self.device)
        rgb = (rgb + 1.0) * change[0] - 1.0  # brightness
        mean = rgb.mean((1, 2, 3), keepdim=True)
        rgb = ((rgb - mean) * change[1] + mean).contiguous(memory_format=torch.channels_last)
        return self.model.loss(rgb, semantic, depth)

    def validate(self) -> Mapping[str, float]:
        """Returns figures of the validation pictures; the score rewards mIoU and small errors of depth."""
        figures = pixel_scores(self.model, self._validation, most=VALIDATED).figures()
        return {**figures, "score": figures["miou"] - figures["depth_error"]}


def labelled(pictures: Pictures, device: torch.device) -> tuple[Tensor, Tensor, Tensor]:
    """Returns RGB (b, 3, h, w) in [-1, 1], classes (b, h, w) int64, and depths (b, h, w) [m] as tensors."""
    return (
        normalised(torch.from_numpy(pictures.rgb).to(device)),
        torch.from_numpy(pictures.semantic).to(device).long(),
        torch.from_numpy(pictures.depth).to(device).float(),
    )


def predict_pixels(model: SegFormer, rgb: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Returns the classes (b, h, w) and depths (b, h, w) [m] that a model finds in pictures (b, h, w, 3)."""
    where = next(model.parameters()).device
    with torch.inference_mode():
        outputs = model(normalised(torch.from_numpy(rgb).to(where)).contiguous(memory_format=torch.channels_last))
        size = rgb.shape[1], rgb.shape[2]
        classes, depth = model.classes(outputs, size), model.depth(outputs, size)
    return classes.cpu().numpy().astype(np.uint8), depth.cpu().numpy()


def pixel_scores(model: SegFormer, pictures: FrameSet, *, most: int | None = None) -> PixelScores:
    """Returns the confusion and the errors of a model on pictures, or on at most a given number, evenly chosen."""
    model.eval()
    count = min(len(pictures), most or len(pictures))
    rows = (np.arange(count) * len(pictures) // max(count, 1)).tolist()
    scores = PixelScores()
    for start in range(0, count, _TESTED):
        batch = pictures.take(rows[start : start + _TESTED])
        classes, depth = predict_pixels(model, batch.rgb)
        scores.add(batch.semantic, classes, batch.depth, depth)
    return scores
