"""Construction of the models of the table (`model_entries`)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from dorothie_gym.baselines.encoders.pretrained import find_transformers, has_minilm, load_pretrained, minilm_folder
from dorothie_gym.baselines.encoders.sound import MEL_FRAMES
from dorothie_gym.baselines.junction_reader.model import JunctionReader
from dorothie_gym.baselines.model_entries import SIZES, ModelEntry
from dorothie_gym.baselines.toto.model import TOTO
from dorothie_gym.baselines.toto.texts import FrozenTexts, PretrainedBert, SmallTextEncoder, Texts, TrainedTexts
from dorothie_gym.baselines.toto.towns import Towns

if TYPE_CHECKING:
    from dorothie_gym.baselines.dataset import Dataset
    from dorothie_gym.baselines.toto.config import TOTOConfig


def make_model(row: ModelEntry, size: str, material: Dataset, seed: int, *, strict: bool = False) -> TOTO:
    """Returns a model with weights drawn from a seed; `strict` as in `TOTOConfig`.

    Raises:
        ValueError: the size is unknown, or the model cannot be run.
    """
    if size not in SIZES:
        raise ValueError(f"there is no config {size!r}; choose from {', '.join(SIZES)}")
    if row.change is None:
        raise ValueError(f"{row.name} is no torch model: {row.missing or f'its kind is {row.kind}'}")
    torch.manual_seed(seed)
    config = replace(row.change(SIZES[size]()), strict=strict)
    if row.queries:
        config = replace(config, detector=material.detector.query_shape)
    if row.sound == "log-mel":
        config = replace(config, sound_frames=MEL_FRAMES)
    elif row.sound is not None:
        config = replace(config, sound_width=material.sounds(row.sound).dim)
    return build_model(row, config, material)


def build_model(row: ModelEntry, config: TOTOConfig, material: Dataset, spread: float | None = None) -> TOTO:
    """Returns a model with random weights.

    Args:
        row: the model's entry.
        config: its sizes and inputs.
        material: dataset with its towns and texts.
        spread: divisor of the vectors of texts; computed from this dataset if None.
    """
    towns, texts = Towns(material.columns.towns), make_texts(config, material, spread)
    if row.kind == "reader":
        assert isinstance(texts, FrozenTexts)  # of `reader_config`
        return JunctionReader(config, towns, texts, material.columns, _pieces(config, material), config.vocabulary)
    return TOTO(config, towns, texts)


def refresh_text_tables(model: TOTO, material: Dataset) -> None:
    """Replaces the texts of a model by those of another dataset."""
    config = model.config
    if config.text == "frozen":
        model.texts.take(material.vectors)
    else:
        model.texts.take(_tokens(config, material))
    if isinstance(model, JunctionReader):
        model.take_words(material.columns.texts, _pieces(config, material))


def make_texts(config: TOTOConfig, material: Dataset, spread: float | None = None) -> Texts:
    """Returns the text embedding of a model: frozen vectors, or a trained encoder."""
    if config.text == "frozen":
        return FrozenTexts(material.vectors, spread)
    tokens = _tokens(config, material)
    if _is_minilm(config):
        model: Any = load_pretrained(find_transformers("minilm").BertModel, minilm_folder(), "minilm")
        return TrainedTexts(tokens, PretrainedBert(model), int(model.config.hidden_size))
    width = config.text_width
    reader = SmallTextEncoder(config.vocabulary, config.text_tokens, width, config.text_layers, config.dropout)
    return TrainedTexts(tokens, reader, width)


def needs_pieces(row: ModelEntry, config: TOTOConfig) -> bool:
    """Returns whether a model uses byte pairs learned from its training sessions."""
    return row.kind == "reader" or (config.text == "trained" and not _is_minilm(config))


def _is_minilm(config: TOTOConfig) -> bool:
    return config.pretrained_text and has_minilm()


def _tokens(config: TOTOConfig, material: Dataset) -> Tensor:
    """Returns the token ids of all texts (n, length) for a trained encoder."""
    if not _is_minilm(config):
        return _pieces(config, material)
    tokenizer: Any = load_pretrained(find_transformers("minilm").AutoTokenizer, minilm_folder(), "minilm")
    pieces = tokenizer(
        list(material.columns.texts),
        padding="max_length",
        truncation=True,
        max_length=config.text_tokens,
        return_tensors="pt",
    )
    ids: Tensor = pieces["input_ids"]
    return ids


def _pieces(config: TOTOConfig, material: Dataset) -> Tensor:
    return material.tokens(None, material.byte_pairs(config.vocabulary), config.text_tokens)
