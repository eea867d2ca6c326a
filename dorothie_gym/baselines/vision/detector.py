"""Deformable DETR on five channels (Zhu et al., 2021; paper, appendix C): RGB, depth and class of each pixel.

Letters in shapes: B pictures of h x w pixels, q queries of d numbers, k kinds of objects. The detector is from
`transformers`, built from a config with a ResNet as backbone; nothing is downloaded. As in the paper, a second head
predicts a box in space for each query.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final, Self

import torch
from torch import Tensor, nn

from dorothie_gym.baselines.vision.frames import CLASSES
from dorothie_gym.baselines.vision.libraries import matcher_of, transformers
from dorothie_gym.baselines.vision.segformer import FARTHEST, NEAREST
from dorothie_gym.baselines.vision.solids import SOLID, solid_loss, solids_from
from dorothie_gym.ontology.slots import ObjectClass

KINDS: Final = (ObjectClass.VEHICLES, ObjectClass.PEDESTRIAN, ObjectClass.STATIC)
"""Kinds of objects that are detected; the last one covers all props."""

_CHANNELS: Final = 4  # RGB and depth; the class is looked up
_PRIOR: Final = 0.01  # sureness at first (Lin et al., 2017)
_FIRST_SOLID: Final = (0.0, 0.0, math.log(15.0), *(math.log(size) for size in (3.0, 1.5, 1.6)), 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class DetectorConfig:
    """Sizes and learning of a Deformable DETR.

    Attributes:
        width: width of the pictures [pixels].
        height: height of the pictures [pixels].
        queries: number of object queries, and thus the most objects found in a picture.
        encoder_layers: number of encoder layers of the transformer.
        decoder_layers: number of decoder layers of the transformer.
        size: numbers of a query.
        feed_forward: width of the feed-forward layers.
        heads: number of attention heads.
        levels: number of resolutions of the backbone that are used, the first of which is 1/8.
        encoded: channels into which the five are encoded.
        backbone_sizes: channels of the four stages of the backbone.
        backbone_depths: blocks of the stages.
        bottleneck: whether the blocks are bottlenecks, as in a ResNet-50.
        two_stage: whether the queries come from the encoder and boxes are refined from layer to layer, which learns
            faster; not as published.
        learning_rate: highest of AdamW.
        backbone_rate: factor of the learning rate in the backbone.
        weight_decay: weight decay of AdamW.
        warm_up: share of the steps in which the learning rate rises.
        batch_size: pictures of a step.
        epochs: passes over the training pictures.
        zoom: share of a picture's width and height in the smallest part that training enlarges to a whole picture.
        least_pixels: minimum number of visible pixels of an object that training requires to be found.
        solid_loss: weight of the loss of boxes in space.
    """

    width: int = 320
    height: int = 192
    queries: int = 50
    encoder_layers: int = 1
    decoder_layers: int = 2
    size: int = 96
    feed_forward: int = 192
    heads: int = 3
    levels: int = 3
    encoded: int = 8
    backbone_sizes: tuple[int, int, int, int] = (32, 64, 96, 128)
    backbone_depths: tuple[int, int, int, int] = (1, 1, 1, 1)
    bottleneck: bool = False
    two_stage: bool = True
    learning_rate: float = 4e-4
    backbone_rate: float = 1.0
    weight_decay: float = 1e-4
    warm_up: float = 0.03
    batch_size: int = 4
    epochs: int = 12
    zoom: float = 0.5
    least_pixels: int = 32
    solid_loss: float = 0.1

    def __post_init__(self) -> None:
        if self.width % 32 or self.height % 32 or min(self.width, self.height) < 64:
            raise ValueError(f"DetectorConfig: {self.width}x{self.height} pixels must be multiples of 32, at least 64")
        if self.size % 32 or self.size % self.heads:
            raise ValueError(f"DetectorConfig.size is {self.size}; it must be a multiple of 32 and of {self.heads}")
        if not 3 <= self.levels <= 4:
            raise ValueError(f"DetectorConfig.levels is {self.levels}; it must be 3 or 4")
        if not 0.1 <= self.zoom <= 1.0:
            raise ValueError(f"DetectorConfig.zoom is {self.zoom}; it must be in 0.1..1")
        if not 0.0 <= self.solid_loss <= 100.0:
            raise ValueError(f"DetectorConfig.solid_loss is {self.solid_loss}; it must be in 0..100")

    @classmethod
    def small(cls) -> Self:
        """Returns small sizes, which learn on a processor core."""
        return cls()

    @classmethod
    def paper(cls) -> Self:
        """Returns the published sizes and learning (appendix C), with a ResNet-50; for a GPU."""
        return cls(
            width=640, height=384, queries=300, encoder_layers=6, decoder_layers=6, size=256, feed_forward=1024,
            heads=8, levels=4, encoded=3, backbone_sizes=(256, 512, 1024, 2048), backbone_depths=(3, 4, 6, 3),
            bottleneck=True, two_stage=False, learning_rate=2e-4, backbone_rate=0.1, epochs=50, batch_size=16,
        )  # fmt: skip

    def to_json(self) -> dict[str, object]:
        """Returns the fields in JSON types."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}


@dataclass(frozen=True, eq=False)
class Targets:
    """Objects that should be detected in a picture.

    Attributes:
        boxes: (n, 4) as in `Detections`.
        kinds: (n,) rows of `KINDS`.
        solids: (n, 8) boxes in space.
        known: (n,) bool, whether the solid is known.
    """

    boxes: Tensor
    kinds: Tensor
    solids: Tensor
    known: Tensor

    def of(self, chosen: Tensor) -> Self:
        """Returns the chosen objects."""
        return type(self)(self.boxes[chosen], self.kinds[chosen], self.solids[chosen], self.known[chosen])

    def to(self, device: torch.device) -> Self:
        """Returns the objects on a device."""
        return type(self)(*(part.to(device) for part in (self.boxes, self.kinds, self.solids, self.known)))


@dataclass(frozen=True, eq=False)
class Detections:
    """Detections in B pictures.

    Attributes:
        boxes: (B, q, 4) centre x and y, width and height, in widths and heights of the picture.
        scores: (B, q, k) sureness in 0..1.
        solids: (B, q, 8) boxes in space, see `solids`.
        queries: (B, q, d) vectors of the queries after the last layer.
    """

    boxes: Tensor
    scores: Tensor
    solids: Tensor
    queries: Tensor


class Detector(nn.Module):
    """Deformable DETR whose five input channels a learned layer encodes, pixel by pixel."""

    def __init__(self, config: DetectorConfig) -> None:
        super().__init__()
        self.config = config
        library = transformers()
        backbone = library.ResNetConfig(
            num_channels=config.encoded,
            embedding_size=min(config.backbone_sizes[0], 64),
            hidden_sizes=list(config.backbone_sizes),
            depths=list(config.backbone_depths),
            layer_type="bottleneck" if config.bottleneck else "basic",
            out_features=["stage2", "stage3", "stage4"],
        )
        self.settings: Any = library.DeformableDetrConfig(
            use_timm_backbone=False, backbone_config=backbone, backbone=None, use_pretrained_backbone=False,
            num_channels=config.encoded, num_queries=config.queries, two_stage_num_proposals=config.queries,
            encoder_layers=config.encoder_layers, decoder_layers=config.decoder_layers, d_model=config.size,
            encoder_ffn_dim=config.feed_forward, decoder_ffn_dim=config.feed_forward, num_labels=len(KINDS),
            encoder_attention_heads=config.heads, decoder_attention_heads=config.heads,
            num_feature_levels=config.levels, auxiliary_loss=True, two_stage=config.two_stage,
            with_box_refine=config.two_stage, dropout=0.1 * (not config.two_stage),
        )  # fmt: skip
        self._without_layers = copy.copy(self.settings)
        self._without_layers.auxiliary_loss = False
        self._matcher: Any = matcher_of(self.settings)
        self.colours = nn.Conv2d(_CHANNELS, config.encoded, 1)
        self.kinds = nn.Embedding(CLASSES, config.encoded)
        self.detr: Any = library.DeformableDetrForObjectDetection(self.settings)
        self.solid_head = nn.Sequential(
            nn.Linear(config.size, config.size),
            nn.ReLU(),
            nn.Linear(config.size, config.size),
            nn.ReLU(),
        )
        last = nn.Linear(config.size, SOLID)
        self.solid_head.append(last)
        self.detr.model.backbone.requires_grad_(True)  # the library freezes it, as if it were trained already
        self._start_heads(last)
        self.register_state_dict_post_hook(_drop_shared)  # type: ignore[no-untyped-call]
        self.register_load_state_dict_pre_hook(_add_shared)  # type: ignore[no-untyped-call]

    def _start_heads(self, last: nn.Linear) -> None:
        """Sets the first outputs of the heads, as the authors' code does: few objects, and boxes at their places."""
        decoder = self.detr.model.decoder
        if self.config.two_stage:  # the decoder refines boxes with the heads themselves
            decoder.bbox_embed, decoder.class_embed = self.detr.bbox_embed, self.detr.class_embed
        for head in self.detr.class_embed:
            nn.init.constant_(head.bias, -math.log((1.0 - _PRIOR) / _PRIOR))
        for head in self.detr.bbox_embed:
            nn.init.zeros_(head.layers[-1].weight)
            nn.init.zeros_(head.layers[-1].bias)
            if not self.config.two_stage:
                nn.init.constant_(head.layers[-1].bias[2:], -2.0)
        nn.init.zeros_(last.weight)
        with torch.no_grad():
            last.bias.copy_(torch.tensor(_FIRST_SOLID))

    def forward(self, rgb: Tensor, depth: Tensor, semantic: Tensor) -> Detections:
        """Returns the detections in pictures (B, 3, h, w) in [-1, 1], depths [m] and classes (B, h, w)."""
        found = self.detr(pixel_values=self.encoded(rgb, depth, semantic))
        solids = solids_from(found.pred_boxes, self.solid_head(found.last_hidden_state))
        return Detections(found.pred_boxes, found.logits.sigmoid(), solids, found.last_hidden_state)

    def encoded(self, rgb: Tensor, depth: Tensor, semantic: Tensor) -> Tensor:
        """Returns the five channels of pictures, encoded (B, c, h, w)."""
        near, far = math.log(NEAREST), math.log(FARTHEST)
        scaled = (depth.clamp(NEAREST, FARTHEST).log() - near) * (2.0 / (far - near)) - 1.0
        mixed: Tensor = self.colours(torch.cat((rgb, scaled[:, None]), 1)) + self.kinds(semantic).permute(0, 3, 1, 2)
        return mixed

    def loss(self, rgb: Tensor, depth: Tensor, semantic: Tensor, wanted: Sequence[Targets]) -> Tensor:
        """Returns the mean loss of B pictures.

        Args:
            rgb: (B, 3, h, w) in [-1, 1].
            depth: (B, h, w) [m].
            semantic: (B, h, w) classes.
            wanted: objects of each picture.
        """
        labels = [{"class_labels": target.kinds, "boxes": target.boxes} for target in wanted]
        found = self.detr(pixel_values=self.encoded(rgb, depth, semantic), labels=labels)
        loss: Tensor = found.loss
        if self.config.two_stage:  # objects of any kind at the cells of the encoder, which the library leaves out
            objects = [{**label, "class_labels": torch.zeros_like(label["class_labels"])} for label in labels]
            proposals = found.enc_outputs_coord_logits.sigmoid()
            loss = (
                loss
                + self.detr.loss_function(
                    found.enc_outputs_class, objects, rgb.device, proposals, self._without_layers, None, None
                )[0]
            )
        if self.config.solid_loss:
            loss = loss + self.config.solid_loss * self._solid_loss(found, labels, wanted)
        return loss

    def _solid_loss(self, found: Any, labels: list[dict[str, Tensor]], wanted: Sequence[Targets]) -> Tensor:
        """Returns the loss of the boxes in space of the queries that are matched to objects."""
        with torch.no_grad():
            pairs = self._matcher({"logits": found.logits, "pred_boxes": found.pred_boxes}, labels)
        solids = solids_from(found.pred_boxes.detach(), self.solid_head(found.last_hidden_state))
        matched = []
        for number, ((queries, objects), target) in enumerate(zip(pairs, wanted, strict=True)):
            known = target.known[objects.to(target.known.device)].to(queries.device)
            rows, places = objects[known].to(solids.device), queries[known].to(solids.device)
            matched.append((solids[number, places], target.solids[rows], target.boxes[rows]))
        return solid_loss(*(torch.cat(column) for column in zip(*matched, strict=True)))


def _second_names(module: nn.Module) -> dict[str, str]:
    """Returns the first name of each parameter by its further names, under which layers share it."""
    first: dict[int, str] = {}
    every = module.named_parameters(remove_duplicate=False)
    return {name: first[id(found)] for name, found in every if first.setdefault(id(found), name) != name}


def _drop_shared(module: nn.Module, state: dict[str, Any], prefix: str, metadata: Any) -> None:
    """Leaves the further names of shared weights out of a state: files hold each weight once."""
    for second in _second_names(module):
        state.pop(prefix + second, None)


def _add_shared(module: nn.Module, state: dict[str, Any], prefix: str, *unused: Any) -> None:
    """Adds the further names of shared weights to a state that is loaded."""
    for second, first in _second_names(module).items():
        if prefix + first in state:
            state[prefix + second] = state[prefix + first]
