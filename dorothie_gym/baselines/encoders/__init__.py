"""Encoders of texts, speech and images: mappings to vectors, with frozen weights or without weights."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from dorothie_gym.baselines.encoders.byte_pairs import PAD, BytePairs
from dorothie_gym.baselines.encoders.encoder import (
    Encoder,
    HashingEncoder,
    ImageEncoder,
    SpeechEncoder,
    TextEncoder,
    Vectors,
    table_key,
    text_table,
)
from dorothie_gym.baselines.encoders.pretrained import (
    BertEncoder,
    HubertEncoder,
    MiniLMEncoder,
    ResNetEncoder,
    has_minilm,
)
from dorothie_gym.baselines.encoders.sound import SoundReader, SpeechEmbeddingEncoder, mel_table
from dorothie_gym.errors import EncoderError

TEXT_ENCODERS: Mapping[str, Callable[[], TextEncoder]] = MappingProxyType(
    {"hashing": HashingEncoder, "minilm": MiniLMEncoder, "bert": BertEncoder}
)
"""Factories of the text encoders, by name."""


def text_encoder(name: str = "auto") -> TextEncoder:
    """Returns an encoder of texts.

    Args:
        name: one of `TEXT_ENCODERS`; "auto" is MiniLM where its weights are installed, else hashing.

    Raises:
        EncoderError: the name is unknown, or a requirement is missing.
    """
    if name == "auto":
        name = "minilm" if has_minilm() else "hashing"
    if name not in TEXT_ENCODERS:
        raise EncoderError(f"there is no text encoder {name!r}; choose auto, {', '.join(TEXT_ENCODERS)}")
    return TEXT_ENCODERS[name]()


__all__ = [
    "PAD",
    "TEXT_ENCODERS",
    "BertEncoder",
    "BytePairs",
    "Encoder",
    "EncoderError",
    "HashingEncoder",
    "HubertEncoder",
    "ImageEncoder",
    "MiniLMEncoder",
    "ResNetEncoder",
    "SoundReader",
    "SpeechEmbeddingEncoder",
    "SpeechEncoder",
    "TextEncoder",
    "Vectors",
    "has_minilm",
    "mel_table",
    "table_key",
    "text_encoder",
    "text_table",
]
