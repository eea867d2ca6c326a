"""Models of the table: their names, commands and changes to TOTO's config. `model_zoo` builds them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final, Literal, TypeAlias

from dorothie_gym.baselines.toto.config import ABLATIONS, Channel, TOTOConfig
from dorothie_gym.errors import did_you_mean
from dorothie_gym.evaluation.teacher_forced.paper_comparison import paper_name

Kind = Literal["toto", "reader", "ppo", "cloning", "shallow"]

Objects: TypeAlias = Literal["record", "boxes", "detections"]
"""Source of the objects around the ego: all nearby ones in the record, only those that the camera on the car shows, or
those that a trained detector finds in its pictures."""

Sound: TypeAlias = Literal["log-mel", "speech-embedding", "hubert"]
"""Encoder of sound: log-mel spectra for a convolution that is trained with the model, or frozen vectors."""

Change: TypeAlias = Callable[[TOTOConfig], TOTOConfig]

SIZES: Final[Mapping[str, Callable[[], TOTOConfig]]] = MappingProxyType(
    {"small": TOTOConfig.small, "paper": TOTOConfig.paper}
)
"""Configurations by name."""

NO_AUDIO: Final = "no audio: the sessions contain no sound"


@dataclass(frozen=True, kw_only=True)
class ModelEntry:
    """Model of the table.

    Attributes:
        name: name in the table; `paper_comparison.COUNTERPARTS` has the paper's row where that is called otherwise.
        command: name on the command line and in paths.
        change: function from TOTO's config to the model's; None for a policy, and if it cannot be run.
        missing: reason why it cannot be run, or empty.
        objects: source of the objects around the ego, see `Dataset.seeing`.
        queries: whether the objects at the point are the queries of the detector, as in the paper.
        sound: encoder of the current utterance's sound; None for models that receive its recognised words.
        kind: "toto" (with ablations and rivals), "reader" (Junction Reader), a policy by "ppo" or "cloning", or
            "shallow" (scikit-learn, see `dorothie_gym.evaluation.teacher_forced.shallow_models`).
    """

    name: str
    command: str
    change: Change | None = None
    missing: str = ""
    objects: Objects = "record"
    queries: bool = False
    sound: Sound | None = None
    kind: Kind = "toto"


def reader_config(config: TOTOConfig) -> TOTOConfig:
    """Returns the reader's config from TOTO's: equal sizes, times back from the point, and a larger weight of slots."""
    channels = tuple(channel for channel in config.channels if channel is not Channel.SPEECH)
    return replace(config, channels=channels, clock="point", loss=replace(config.loss, slot_values=0.3))


def _trained_text(config: TOTOConfig) -> TOTOConfig:
    return replace(config, text="trained")


def _without(name: str) -> Change:
    return lambda config: config.without(*ABLATIONS[name])


def _without_utterance(config: TOTOConfig) -> TOTOConfig:
    return replace(config.without(Channel.SPEECH), current_text=False)


def _only(*channels: Channel) -> Change:
    return lambda config: config.only(channels)


_EPISODIC: Final = (Channel.ACTIONS, Channel.MOVES, Channel.TRANSCRIPT, Channel.VISION)
"""Inputs of the Episodic Transformer in the paper (Pashevich et al., 2021): actions, text, and the window, here
with the objects around the ego instead of images."""

ROWS: Final[tuple[ModelEntry, ...]] = (
    ModelEntry(name="TOTO", command="toto", change=lambda config: config),
    ModelEntry(
        name="TOTO (+ Belief Tracking)", command="toto-belief", change=lambda config: replace(config, belief=True)
    ),
    ModelEntry(name="TOTO (+ Trained Text Encoder)", command="toto-trained-text", change=_trained_text),
    *(
        ModelEntry(name=f"TOTO (- {name})", command=f"toto-no-{name.lower().replace(' ', '-')}", change=_without(name))
        for name in ABLATIONS
    ),
    ModelEntry(name="TOTO (- Current Speech)", command="toto-no-current-speech", missing=NO_AUDIO),
    ModelEntry(name="TOTO (- Current Utterance)", command="toto-no-current-utterance", change=_without_utterance),
    ModelEntry(
        name="Text Only (Trained Encoder)",
        command="text-trained",
        change=lambda config: _trained_text(config.only((Channel.TRANSCRIPT,))),
    ),
    ModelEntry(name="Text Only", command="text", change=_only(Channel.TRANSCRIPT)),
    ModelEntry(name="HuBERT Only", command="hubert", missing=NO_AUDIO),
    ModelEntry(name="Objects Only", command="objects", change=_only(Channel.OBJECTS)),
    ModelEntry(name="Map Encoder Only", command="map", change=_only(Channel.MAP)),
    ModelEntry(name="TOTO (Episodic Inputs)", command="toto-episodic", change=_only(*_EPISODIC)),
    ModelEntry(
        name="TOTO (Episodic Inputs, Trained Text Encoder)",
        command="toto-episodic-trained-text",
        change=lambda config: _trained_text(config.only(_EPISODIC)),
    ),
    ModelEntry(
        name="TOTO (point clock)",
        command="toto-point-clock",
        change=lambda config: replace(config, clock="point"),
    ),
    ModelEntry(name="Boosted Trees (no words)", command="trees", kind="shallow"),
    ModelEntry(name="TF-IDF Logistic Regression (words only)", command="tfidf", kind="shallow"),
    ModelEntry(name="Behaviour Cloning", command="cloning", kind="cloning"),
    ModelEntry(name="PPO", command="ppo", kind="ppo"),
    ModelEntry(name="Junction Reader (ours)", command="reader", change=reader_config, kind="reader"),
)
"""Counterparts of the paper's rows, in its order; then TOTO with another clock, shallow models, policies, and the
Junction Reader. TOTO without the current utterance is compared with the paper's row without its sound."""

_SEEN: Final[Mapping[str, Objects]] = MappingProxyType({"oracle boxes": "boxes", "detections": "detections"})

CAMERA_ROWS: Final = (
    *(
        replace(row, name=f"{row.name} ({name})", command=f"{row.command}-{objects}", objects=objects)
        for name, objects in _SEEN.items()
        for row in ROWS
        if row.command in ("toto", "objects", "toto-episodic", "toto-episodic-trained-text")
    ),
    *(
        replace(row, name=f"{row.name} (queries)", command=f"{row.command}-queries", objects="detections", queries=True)
        for row in ROWS
        if row.command in ("toto", "objects")
    ),
)
"""Models whose objects are visible to the car's camera, or found by a trained detector in its pictures; or
all queries of the detector at the point, as in the paper. They are trained where they are named: pictures of a corpus
take minutes."""


SOUND_ROWS: Final = (
    ModelEntry(name="TOTO (+ Log-mel Speech)", command="toto-sound", change=lambda config: config, sound="log-mel"),
    ModelEntry(
        name="TOTO (+ Speech Embedding)",
        command="toto-embedding",
        change=lambda config: config,
        sound="speech-embedding",
    ),
    ModelEntry(name="TOTO (+ HuBERT)", command="toto-hubert", change=lambda config: config, sound="hubert"),
    ModelEntry(
        name="TOTO (- Current Speech, Words Kept)", command="toto-words", change=lambda c: c.without(Channel.SPEECH)
    ),
    ModelEntry(name="Log-mel Only", command="sound", change=_only(Channel.SPEECH), sound="log-mel"),
    ModelEntry(
        name="Speech Embedding Only", command="sound-embedding", change=_only(Channel.SPEECH), sound="speech-embedding"
    ),
    ModelEntry(
        name="HuBERT Only (weights of a folder)", command="sound-hubert", change=_only(Channel.SPEECH), sound="hubert"
    ),
    ModelEntry(
        name="Text + Log-mel", command="text-sound", change=_only(Channel.TRANSCRIPT, Channel.SPEECH), sound="log-mel"
    ),
)
"""Models of spoken corpora, whose current utterance is heard as sound. TOTO without the current speech keeps the words
of the current utterance, as in the paper's row. They are trained where they are named.
"""


ALL_ROWS: Final = (*ROWS, *CAMERA_ROWS, *SOUND_ROWS)

_CALLED: Final[Mapping[str, str]] = MappingProxyType(
    {
        "bert": "text",
        "bert-trained": "text-trained",
        "toto-bert": "toto-trained-text",
        "bert-sound": "text-sound",
        "detector": "objects",
        "et": "toto-episodic",
        "et-bert": "toto-episodic-trained-text",
        "toto-no-object-detection": "toto-no-objects",
        "toto-no-vision-history": "toto-no-object-history",
    }
)
_SOURCES: Final = ("", "-boxes", "-detections", "-queries")

FORMER_COMMANDS: Final[Mapping[str, str]] = MappingProxyType(
    {
        former + source: now + source
        for former, now in _CALLED.items()
        for source in _SOURCES
        if now + source in {row.command for row in ALL_ROWS}
    }
)
"""Commands of this version by the commands of versions up to 0.1, which used the paper's names and wrote them to
`model.json`.
"""


def find_row(name: str) -> ModelEntry:
    """Returns a model by its command or name.

    Raises:
        ValueError: there is none; the message lists all, or names the one that is compared with this row of the paper.
    """
    for row in ALL_ROWS:
        if name.casefold() in (row.command, row.name.casefold()):
            return row
    commands = tuple(row.command for row in ALL_ROWS)
    called = FORMER_COMMANDS.get(name.casefold()) or _counterpart(name)
    if called is not None:
        raise ValueError(f"there is no model {name!r}: it is called {called!r}, which says what it is (docs/models.md)")
    raise ValueError(f"there is no model {name!r}; {did_you_mean(name, commands)}choose from {', '.join(commands)}")


def stored_row(command: str) -> ModelEntry:
    """Returns the model of a file by its command, also of an earlier version; raises `ValueError` like `find_row`."""
    return find_row(FORMER_COMMANDS.get(command, command))


def _counterpart(name: str) -> str | None:
    """Returns the command of the model that is compared with a row of the paper; None for other names."""
    row = paper_name(name)
    return None if row is None else next(entry.command for entry in ROWS if paper_name(entry.name) == row)
