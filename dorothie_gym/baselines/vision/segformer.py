"""SegFormer with two heads: classes and depth (Xie et al., 2021; paper, appendix C).

Letters in shapes: B pictures of h x w pixels, C channels of the decoder, k classes, b bins of depth. The encoder is
that of `transformers`, built from a config; nothing is downloaded.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Final, Self

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from dorothie_gym.baselines.vision.frames import CLASSES
from dorothie_gym.baselines.vision.libraries import transformers

NEAREST, FARTHEST = 1.0, 200.0
"""Range of the bins of depth [m]; larger depths fall into the last bin."""


@dataclass(frozen=True, kw_only=True)
class SegFormerConfig:
    """Sizes and learning of a SegFormer.

    Attributes:
        width: width of the pictures [pixels].
        height: height of the pictures [pixels].
        depths: blocks of each stage.
        hidden_sizes: channels of each stage.
        heads: attention heads of each stage.
        mlp_ratio: width of the feed-forward layers, in channels of their stage.
        decoder: channels of the decoder.
        detail: places on each side of a cell of 4 x 4 pixels for which classes are predicted; 1 as published.
        depth_detail: the same for depth.
        bins: number of depth bins, evenly spaced in the logarithm.
        dropout: dropout of the decoder.
        learning_rate: highest of AdamW; it rises over the first steps and then falls to 0, evenly.
        weight_decay: weight decay of AdamW.
        warm_up: share of the steps in which the learning rate rises.
        batch_size: pictures of a step.
        epochs: passes over the training pictures.
        coarse: share of the epochs, the first ones, in which pictures have half the width and height.
        rarity: exponent of the inverse frequency of a class in its weight; 0 for equal weights, as published.
        overlap: weight of the soft Jaccard loss.
        depth_loss: weight of the depth head's losses.
    """

    width: int = 320
    height: int = 192
    depths: tuple[int, int, int, int] = (1, 1, 2, 2)
    hidden_sizes: tuple[int, int, int, int] = (32, 64, 128, 192)
    heads: tuple[int, int, int, int] = (1, 2, 4, 6)
    mlp_ratio: int = 3
    decoder: int = 96
    detail: int = 4
    depth_detail: int = 2
    bins: int = 256
    dropout: float = 0.0
    learning_rate: float = 1e-3
    weight_decay: float = 0.01
    warm_up: float = 0.05
    batch_size: int = 8
    epochs: int = 16
    coarse: float = 0.75
    rarity: float = 0.4
    overlap: float = 0.5
    depth_loss: float = 0.5

    def __post_init__(self) -> None:
        if self.width % 64 or self.height % 64 or min(self.width, self.height) < 64:
            raise ValueError(f"SegFormerConfig: {self.width}x{self.height} pixels must be multiples of 64")
        if self.detail not in (1, 2, 4) or self.depth_detail not in (1, 2, 4):
            raise ValueError(f"SegFormerConfig: detail {self.detail} and {self.depth_detail} must be 1, 2 or 4")
        if self.epochs < 1 or not 0.0 <= self.coarse <= 1.0:
            raise ValueError(f"SegFormerConfig: epochs {self.epochs} must be at least 1, coarse {self.coarse} in 0..1")

    @property
    def coarse_epochs(self) -> int:
        """Number of epochs in which pictures have half the width and height."""
        return round(self.coarse * self.epochs)

    @classmethod
    def small(cls) -> Self:
        """Returns small sizes, which learn on a processor core."""
        return cls()

    @classmethod
    def paper(cls) -> Self:
        """Returns the published learning (appendix C) and the sizes of MiT-B0, its smallest encoder; for a GPU."""
        return cls(
            width=640, height=384, depths=(2, 2, 2, 2), hidden_sizes=(32, 64, 160, 256), heads=(1, 2, 5, 8),
            mlp_ratio=4, decoder=256, detail=1, depth_detail=1, dropout=0.1, learning_rate=6e-5, epochs=160,
            coarse=0.0, rarity=0.0, overlap=0.0, warm_up=0.01, batch_size=16,
        )  # fmt: skip

    def to_json(self) -> dict[str, object]:
        """Returns the fields in JSON types."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}


@dataclass(frozen=True, eq=False)
class SegFormerOutputs:
    """Outputs for B pictures.

    Attributes:
        features: (B, C, h / 4, w / 4) of the decoder.
        classes: (B, k, h / 4 * detail, w / 4 * detail) scores.
    """

    features: Tensor
    classes: Tensor


class SegFormer(nn.Module):
    """SegFormer with a head for classes and one for depth.

    The published decoder brings each stage to the same channels, joins them, and mixes the channels. As nothing lies
    between these two linear layers, each stage has one layer here, and the results are added.

    Args:
        config: sizes.
        frequencies: share of the pixels of each class in the training pictures (k,), for the weights of the classes.
    """

    def __init__(self, config: SegFormerConfig, frequencies: Tensor | None = None) -> None:
        super().__init__()
        self.config = config
        library = transformers()
        self.encoder: Any = library.SegformerModel(
            library.SegformerConfig(
                depths=list(config.depths),
                hidden_sizes=list(config.hidden_sizes),
                num_attention_heads=list(config.heads),
                mlp_ratios=[config.mlp_ratio] * 4,
                hidden_dropout_prob=0.0,
                attention_probs_dropout_prob=0.0,
                drop_path_rate=0.1 * (config.dropout > 0),
            )
        )
        self.projections = nn.ModuleList(nn.Conv2d(size, config.decoder, 1) for size in config.hidden_sizes)
        self.norm = nn.BatchNorm2d(config.decoder)
        self.dropout = nn.Dropout2d(config.dropout)
        self.class_head = nn.Conv2d(config.decoder, CLASSES * config.detail**2, 1)
        self.depth_head = nn.Conv2d(config.decoder, config.bins * config.depth_detail**2, 1)
        self.bin_width = math.log(FARTHEST / NEAREST) / config.bins
        centres = math.log(NEAREST) + (torch.arange(config.bins) + 0.5) * self.bin_width
        self.register_buffer("bin_centres", centres, persistent=False)  # logarithms
        self.register_buffer("class_weights", torch.ones(CLASSES))
        if frequencies is not None:
            self.class_weights.copy_(class_weights(frequencies, config.rarity))

    bin_centres: Tensor
    class_weights: Tensor

    @property
    def pooled_size(self) -> int:
        """Numbers of a picture's vector."""
        return self.config.hidden_sizes[-1]

    def forward(self, pictures: Tensor) -> SegFormerOutputs:
        """Returns the outputs for pictures (B, 3, h, w) in [-1, 1]."""
        features = self.features(pictures)
        return SegFormerOutputs(features, F.pixel_shuffle(self.class_head(features), self.config.detail))

    def features(self, pictures: Tensor) -> Tensor:
        """Returns the output of the decoder (B, C, h / 4, w / 4) for pictures (B, 3, h, w) in [-1, 1]."""
        stages = self.encoder(pictures, output_hidden_states=True).hidden_states  # finest first
        features = self.projections[-1](stages[-1])
        for stage, projection in zip(reversed(stages[:-1]), list(self.projections)[-2::-1], strict=True):
            fine = projection(stage)
            features = fine + F.interpolate(features, size=fine.shape[-2:], mode="bilinear", align_corners=False)
        mixed: Tensor = self.dropout(F.relu(self.norm(features)))
        return mixed

    def classes(self, outputs: SegFormerOutputs, size: tuple[int, int]) -> Tensor:
        """Returns the most likely class of each pixel (B, h, w)."""
        return enlarged(outputs.classes, size).max(1).indices  # equal to argmax, but faster on a CPU

    def depth(self, outputs: SegFormerOutputs, size: tuple[int, int]) -> Tensor:
        """Returns the depth of each pixel (B, h, w) [m]: the median of the bins, which minimises the expected error."""
        places = [self._median_bins(features) for features in torch.split(outputs.features, 1)]  # all at once is slower
        logarithm = math.log(NEAREST) + torch.cat(places) * self.bin_width
        return enlarged(F.pixel_shuffle(logarithm, self.config.depth_detail), size)[:, 0].exp()

    def _median_bins(self, features: Tensor) -> Tensor:
        """Returns the medians of the bins (B, places of a cell, h / 4, w / 4), in bins counted from the nearest."""
        config = self.config
        scores = self.depth_head(features.contiguous()).float()
        batch, _, height, width = scores.shape
        scores = scores.view(batch, config.bins, config.depth_detail**2, height, width)
        share = scores.sub_(scores.amax(1, keepdim=True)).exp_()
        size_of_block = math.gcd(config.bins, 16)  # the median is found in blocks of bins first, which is faster
        blocks = share.unflatten(1, (-1, size_of_block))
        ends = blocks.sum(2).cumsum(1)
        half = 0.5 * ends[:, -1:]
        block, before = _crossed(ends, half, torch.zeros_like(half))
        inside = blocks.take_along_dim(block[:, :, None], 1)[:, 0].cumsum(1) + before
        below, lower = _crossed(inside, half, before)
        upper = inside.gather(1, below)
        within = ((half - lower) / (upper - lower).clamp(min=1e-12)).clamp(0.0, 1.0)
        median: Tensor = (block * size_of_block + below + within)[:, 0]
        return median

    def loss(self, pictures: Tensor, semantic: Tensor, depth: Tensor) -> Tensor:
        """Returns the mean loss of B pictures at some random places of each cell, the same in all cells.

        Args:
            pictures: (B, 3, h, w) in [-1, 1].
            semantic: (B, h, w) classes, int64.
            depth: (B, h, w) [m], infinite for the sky.
        """
        config = self.config
        features = self.features(pictures)
        losses = [features.sum() * 0.0]
        count = min(CLASS_PLACES, config.detail**2)
        for place in torch.randperm(config.detail**2)[:count].tolist():
            scores = self._scores(features, self.class_head, place, config.detail**2)
            kinds = sampled(semantic, place, config.detail, features)
            losses.append(F.cross_entropy(scores, kinds, self.class_weights) / count)
            if config.overlap:
                losses.append(config.overlap / count * soft_jaccard_loss(scores, kinds))
        detail = config.depth_detail
        place = int(torch.randint(detail**2, ()))
        scores = self._scores(features, self.depth_head, place, detail**2)
        means = F.avg_pool2d(depth.log()[:, None], depth.shape[-1] // (features.shape[-1] * detail))[:, 0]
        losses.append(
            config.depth_loss * self._depth_loss(scores, means[:, place // detail :: detail, place % detail :: detail])
        )
        return torch.stack(losses).sum()

    @staticmethod
    def _scores(features: Tensor, head: nn.Conv2d, place: int, places: int) -> Tensor:
        """Returns the scores of a head (B, n, h / 4, w / 4) at one place of each cell, as `pixel_shuffle` counts."""
        bias = None if head.bias is None else head.bias[place::places]
        return F.conv2d(features, head.weight[place::places], bias).float()

    def _depth_loss(self, scores: Tensor, depth: Tensor) -> Tensor:
        """Returns the loss of scores (B, b, ...) of log depths (B, ...): entropy of the bins, and expected error."""
        known = depth.isfinite()
        if not bool(known.any()):
            return scores.sum() * 0.0
        wanted = depth[known].clamp(math.log(NEAREST), math.log(FARTHEST))
        scores = scores.permute(0, 2, 3, 1)[known]  # (n, b)
        exact = ((wanted - math.log(NEAREST)) / self.bin_width - 0.5).clamp(0.0, self.config.bins - 1.001)
        lower = exact.floor().long()
        share = exact - lower
        logarithms = scores.log_softmax(1)
        between = torch.stack((1.0 - share, share), 1) * logarithms.gather(1, torch.stack((lower, lower + 1), 1))
        errors = (self.bin_centres - wanted[:, None]).abs()  # (n, b)
        return -0.2 * between.sum(1).mean() + 2.0 * (logarithms.exp() * errors).sum(1).mean()


def _crossed(sums: Tensor, level: Tensor, before: Tensor) -> tuple[Tensor, Tensor]:
    """Returns the first of rising sums (B, n, ...) that reaches a level (B, 1, ...), and the sum before it.

    Args:
        sums: (B, n, ...).
        level: (B, 1, ...).
        before: sum before the first (B, 1, ...).
    """
    first = (sums < level).sum(1, keepdim=True).clamp(max=sums.shape[1] - 1)
    return first, torch.where(first > 0, sums.gather(1, (first - 1).clamp(min=0)), before)


CLASS_PLACES: Final = 4
"""Places of a cell at which a step of the training computes the loss of the classes."""


def sampled(labels: Tensor, place: int, detail: int, features: Tensor) -> Tensor:
    """Returns the labels (B, h / 4, w / 4) in the middle of one place of each cell; labels are (B, h, w)."""
    step = labels.shape[-1] // (features.shape[-1] * detail)  # pixels of a place
    row, column = place // detail * step + step // 2, place % detail * step + step // 2
    return labels[:, row :: step * detail, column :: step * detail]


def enlarged(scores: Tensor, size: tuple[int, int]) -> Tensor:
    """Returns scores (B, k, ...) at the size of a picture."""
    if tuple(scores.shape[-2:]) == tuple(size):
        return scores
    return F.interpolate(scores, size=size, mode="bilinear", align_corners=False)


def class_weights(frequencies: Tensor, exponent: float) -> Tensor:
    """Returns weights of the classes (k,), with mean 1 over the pixels; 0 for a class that does not occur."""
    share = frequencies / frequencies.sum()
    weights = torch.where(share > 0, share.clamp(min=1e-4) ** -exponent, torch.zeros_like(share))
    return (weights / (weights * share).sum()).float()


def soft_jaccard_loss(scores: Tensor, semantic: Tensor) -> Tensor:
    """Returns 1 less the mean soft Jaccard index of the classes that occur in a batch.

    Args:
        scores: (B, k, h, w).
        semantic: (B, h, w) classes.
    """
    share = scores.softmax(1).transpose(0, 1).flatten(1)  # (k, n)
    kinds = semantic.flatten()
    right = share.gather(0, kinds[None])[0]  # share of the true class
    zeros = torch.zeros(len(share), device=scores.device)
    met = zeros.index_add(0, kinds, right)
    count = zeros.index_add(0, kinds, torch.ones_like(right))
    union = share.sum(1) + count - met
    occurs = count > 0
    return 1.0 - (met[occurs] / union[occurs]).mean()


def normalised(rgb: Tensor) -> Tensor:
    """Returns pictures (B, h, w, 3) uint8 as (B, 3, h, w) in [-1, 1]."""
    return rgb.permute(0, 3, 1, 2).float() / 127.5 - 1.0
