"""Sizes, inputs and learning of TOTO: as published, and small."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from dataclasses import fields as dataclass_fields
from types import MappingProxyType
from typing import Any, Final, Literal, Self

from dorothie_gym.errors import InputFileError
from dorothie_gym.evaluation.teacher_forced.features.batch import HISTORY, BatchSpec, HistorySizes
from dorothie_gym.support.input_files import checked


class Channel(enum.StrEnum):
    """Kind of input; a model receives only its channels."""

    MAP = "map"
    """The lane graph, known landmarks and streets."""
    TRAJECTORY = "trajectory"
    """Poses of the ego in the last ten seconds."""
    ACTIONS = "actions"
    """Physical actions so far."""
    MOVES = "moves"
    """Dialogue moves so far, with their slots."""
    TRANSCRIPT = "transcript"
    """Spoken words, including those of the current utterance."""
    VISION = "vision"
    """Objects around the ego in the last ten seconds."""
    SPEECH = "speech"
    """The current utterance as heard: its sound, or its recognised words if there is no sound."""
    OBJECTS = "objects"
    """Objects around the ego at the point."""


ALL_CHANNELS: Final = tuple(Channel)

ABLATIONS: Final[Mapping[str, tuple[Channel, ...]]] = MappingProxyType(
    {
        "Action History": (Channel.ACTIONS, Channel.MOVES),
        "GT Transcript": (Channel.TRANSCRIPT,),
        "Objects": (Channel.OBJECTS,),
        "Object History": (Channel.VISION, Channel.OBJECTS),
        "Map Knowledge": (Channel.MAP, Channel.TRAJECTORY),
    }
)
"""Inputs that ablations of TOTO remove, named after their rows; the object history includes the present."""

TextTraining = Literal["frozen", "trained"]

Clock = Literal["point", "session"]


@dataclass(frozen=True, kw_only=True)
class LossWeights:
    """Weights of the parts of the loss (paper, appendix C, Loss coefficients).

    Attributes:
        move, slot_types, slot_values: of UfN and of RfN; cross entropy, and binary cross entropies.
        action: NfD action; cross entropy.
        angle: NfD angle; error of the angle [1/degree].
        belief: error of the belief [1/unit].
    """

    move: float = 1.0
    slot_types: float = 1e-2
    slot_values: float = 2e-3
    action: float = 1.0
    angle: float = 1e-2
    belief: float = 1e-3


MAX_SIZE: Final = 8192
"""Largest width of a layer."""

_RANGES: Final = (
    *((name, 1, MAX_SIZE) for name in ("width", "feed_forward", "text_width", "lane_width", "id_width")),
    *((name, 0, MAX_SIZE) for name in ("image_width", "sound_width", "sound_frames")),
    *((name, 1, 64) for name in ("layers", "heads", "map_heads", "text_layers")),
    ("text_tokens", 1, 512),
    ("vocabulary", 1, 1 << 16),
    ("roads", 1, 1 << 16),
    ("junctions", 1, 1 << 16),
    ("batch_size", 1, 1 << 16),
    ("patience", 1, 1 << 16),
    ("min_epochs", 0, 1 << 20),
    ("max_epochs", 1, 1 << 20),
    ("dropout", 0.0, 0.999),
    ("attention_dropout", 0.0, 0.999),
    ("learning_rate", 0.0, 10.0),
    ("weight_decay", 0.0, 10.0),
    ("clip", 0.0, 1e6),
)
"""Minimum and maximum values of numbers."""


@dataclass(frozen=True, kw_only=True)
class TOTOConfig(HistorySizes):
    """Hyperparameters and inputs of a TOTO model. Each ablation of the table is one value of `channels`.

    The fields of `HistorySizes` limit the history that the model receives.

    Attributes:
        width: numbers of a token.
        layers, heads, feed_forward, dropout: of the encoder.
        attention_dropout: share of the attention's weights that are dropped.
        channels: inputs of the model.
        current_text: whether the words of the current utterance are among the transcript.
        strict: whether RfN points hide the earlier acts of the Co-Wizard's own utterance.
        belief: whether the model also predicts the car's next position and its goal.
        clock: origin of a token's time: the start of the "session", as published, or back from the
            "point". Tokens known from the start then have the session's time: both carry the same information.
        text: "frozen" vectors of a text encoder, or a "trained" encoder.
        text_width, text_layers, text_tokens, vocabulary: of the trained text encoder, if it is not MiniLM.
        pretrained_text: whether the trained text encoder is MiniLM, where its weights are installed.
        lane_width: numbers of a lane's vector, a multiple of `map_heads`.
        map_heads: heads of the graph attention.
        id_width: numbers of the vector looked up for a road, and for a junction.
        roads, junctions: sizes of those tables; ids beyond them share rows.
        image_width: numbers of a picture's vector at each token of the window; 0 if there is no camera.
        sound_width: numbers of the vector of the current utterance's sound; 0 if there is no such vector.
        sound_frames: frames of its log-mel spectrum, which a small convolution reads that is trained with the model; 0
            if there is no such spectrum.
        detector: (queries, numbers each) of an object detector; None: objects come from the world's list.
        learning_rate, weight_decay, clip: of AdamW, and the largest norm of the gradient.
        batch_size: points of a step.
        min_epochs, max_epochs: minimum and maximum number of epochs.
        patience: epochs without a better validation loss after which training stops.
        loss: weights of its parts.

    Raises:
        ValueError: a field is out of its range; the message names it.
    """

    width: int
    layers: int
    heads: int
    feed_forward: int
    dropout: float = 0.1
    attention_dropout: float = 0.1
    channels: tuple[Channel, ...] = ALL_CHANNELS
    current_text: bool = True
    strict: bool = False
    belief: bool = False
    clock: Clock = "session"
    text: TextTraining = "frozen"
    text_width: int = 128
    text_layers: int = 2
    text_tokens: int = 24
    vocabulary: int = 1024
    pretrained_text: bool = False
    lane_width: int = 64
    map_heads: int = 8
    id_width: int = 25
    roads: int = 259
    junctions: int = 34
    image_width: int = 0
    sound_width: int = 0
    sound_frames: int = 0
    detector: tuple[int, int] | None = None
    learning_rate: float = 1e-5
    weight_decay: float = 1e-4
    clip: float = 1.0
    batch_size: int = 64
    min_epochs: int = 10
    max_epochs: int = 60
    patience: int = 5
    loss: LossWeights = LossWeights()

    def __post_init__(self) -> None:
        super().__post_init__()
        if min(self.heads, self.map_heads) < 1:
            raise ValueError(f"TOTOConfig: heads {self.heads} and map_heads {self.map_heads} must be at least 1")
        if self.width % self.heads:
            raise ValueError(f"TOTOConfig.width is {self.width}; it must be a multiple of heads, {self.heads}")
        if self.width % 2:
            raise ValueError(f"TOTOConfig.width is {self.width}; it must be even: half of the time is sines")
        if self.lane_width % self.map_heads:
            raise ValueError(f"TOTOConfig.lane_width is {self.lane_width}; it must be a multiple of {self.map_heads}")
        if not 0.0 <= self.dropout < 1.0:
            raise ValueError(f"TOTOConfig.dropout is {self.dropout}; it must be in [0, 1)")
        if not self.channels:
            raise ValueError("TOTOConfig.channels is empty; a model needs an input")
        if self.min_epochs > self.max_epochs:
            raise ValueError(f"TOTOConfig.min_epochs is {self.min_epochs}, above max_epochs, {self.max_epochs}")
        if self.detector is not None and not all(0 < size <= MAX_SIZE for size in self.detector):
            raise ValueError(f"TOTOConfig.detector is {self.detector}; both numbers must be in 1..{MAX_SIZE}")
        for name, least, most in _RANGES:
            if not least <= getattr(self, name) <= most:
                raise ValueError(f"TOTOConfig.{name} is {getattr(self, name)}; it must be in {least:g}..{most:g}")

    @property
    def weights_at_least(self) -> int:
        """Lower bound of the number of weights of a model: those of its largest layers."""
        layer = 4 * self.width**2 + 2 * self.width * self.feed_forward
        return self.layers * layer + self.id_width * (self.roads + self.junctions)

    @classmethod
    def paper(cls) -> Self:
        """Returns the published sizes (paper, appendix C); 770 numbers are BERT's 768 and two for the role."""
        return cls(width=770, layers=2, heads=11, feed_forward=770, text_width=384, pretrained_text=True)

    @classmethod
    def published(cls) -> Self:
        """Returns the published sizes with image, sound and detector inputs, for measurements of speed."""
        return replace(cls.paper(), image_width=1000, sound_width=1024, detector=(300, 256))

    @classmethod
    def small(cls) -> Self:
        """Returns small sizes, the default: training takes less than a minute on two cores."""
        return cls(
            width=96, layers=2, heads=4, feed_forward=192, text_width=96, text_layers=1, text_tokens=20,
            lane_width=32, map_heads=4, id_width=8, moves=12, utterances=6, actions=10, window=8, window_step=12,
            window_objects=6, objects=10, attention_dropout=0.0, learning_rate=1e-3, batch_size=64, max_epochs=16,
        )  # fmt: skip

    @property
    def spec(self) -> BatchSpec:
        """Sizes of the model's batches."""
        return BatchSpec(**{name: getattr(self, name) for name in HISTORY}, strict=self.strict)

    def without(self, *channels: Channel) -> Self:
        """Returns the config without the given inputs."""
        return replace(self, channels=tuple(channel for channel in self.channels if channel not in channels))

    def only(self, channels: Iterable[Channel]) -> Self:
        """Returns the config with these inputs and no others."""
        wanted = set(channels)
        return replace(self, channels=tuple(channel for channel in ALL_CHANNELS if channel in wanted))

    def to_json(self) -> dict[str, object]:
        """Returns the fields in JSON types."""
        fields = asdict(self)
        fields["channels"] = [channel.value for channel in self.channels]
        fields["detector"] = None if self.detector is None else list(self.detector)
        return fields

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Reads the output of `to_json`.

        Raises:
            InputFileError: a field is unknown, missing, of another type or out of its range.
        """
        known = {"strict": True, "sound_frames": 0, **fields}  # models without the fields were trained so
        if missing := sorted({field.name for field in dataclass_fields(cls)} - set(known)):
            raise InputFileError("TOTOConfig", f"the field {missing[0]!r} is missing; the model is of another version")
        return checked(known, cls, "TOTOConfig")
