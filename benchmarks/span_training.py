"""Trains the tagger of spans (`dorothie_gym.dialogue.span_tagger`), or compares it with the rules.

    python -m benchmarks.span_training                 # writes the weights into the package
    python -m benchmarks.span_training --folds 3       # cross-validation by sentences, and `people/` dev
    python -m benchmarks.span_training --minilm        # with other words than those of the weights

The vectors of words are those of the weights, or are made from the table of word pieces of MiniLM (extra `minilm`).
The script needs torch (extra `baselines`), and two minutes of processor time for each training. The weights are
reproducible with one processor and one version of torch; others round differently.
"""

from __future__ import annotations

import argparse
import io
import random
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors.numpy import load_file
from torch import Tensor, nn
from torch.nn import functional as F

from benchmarks.span_sentences import (
    FOLDER,
    Example,
    Sentence,
    compositions,
    example,
    grammar_sentences,
    read_training_sentences,
    variants,
)
from dorothie_gym.baselines.encoders.pretrained import minilm_folder
from dorothie_gym.dialogue.span_inputs import ACTIONS, MARKS, MASKS, SIGNS
from dorothie_gym.dialogue.span_tagger import (
    BUCKETS,
    DILATIONS,
    HIDDEN_BITS,
    INPUT_BITS,
    KERNEL,
    WEIGHTS_FILE,
    letter_groups,
    unpack,
    word_row,
)
from dorothie_gym.ontology import DialogueMove
from dorothie_gym.support.files import write_atomically

TARGET: Final = Path(__file__).parent.parent / "dorothie_gym" / "dialogue" / "data" / WEIGHTS_FILE
MOVES: Final = tuple(DialogueMove)
LABELS: Final = 2 * len(MOVES)
CENTRE: Final = 8
STEP: Final = 12 / (1 << INPUT_BITS)
"""Step of a word's vector, whose numbers have four bits."""


@dataclass(frozen=True, kw_only=True)
class TrainingConfig:
    """Settings of the network and its training, chosen by cross-validation.

    Attributes:
        words: number of words with a vector of their own.
        width: numbers of a word's vector.
        letters: numbers of a letter group's vector.
        hidden: values behind each convolution.
        composed: sentences put together of spans of others.
        sampled: sentences of the grammar.
        grammar_weight: weight of a sentence of the grammar.
        action_weight: weight of the loss of the actions of a span.
        epochs: passes over the sentences.
        batch: sentences a step.
        rate: largest learning rate (one cycle; Smith and Topin, 2019).
        dropout: share of values that are left out in training.
        forgotten: share of words that are unknown in training.
        seed: seed of everything random.
    """

    words: int = 5000
    width: int = 48
    letters: int = 24
    hidden: int = 64
    composed: int = 1200
    sampled: int = 1500
    grammar_weight: float = 0.5
    action_weight: float = 1.0
    epochs: int = 8
    batch: int = 64
    rate: float = 4e-3
    dropout: float = 0.4
    forgotten: float = 0.06
    seed: int = 0


WordVectors = tuple[tuple[str, ...], NDArray[np.float32]]
"""Words, and the vectors (n, d) of these, of masks and of unknown words."""


def shipped_vectors() -> WordVectors:
    """Returns the words and vectors of the package's weights."""
    tagger = unpack(TARGET.read_bytes())
    return tuple(tagger.words), (tagger.vectors / (1 << INPUT_BITS)).astype(np.float32)


def minilm_vectors(seen: Iterable[str], config: TrainingConfig) -> WordVectors:
    """Returns words, and their vectors from MiniLM's table: principal components, rounded to four bits.

    Args:
        seen: words of the training sentences; the others are MiniLM's first.
        config: settings.
    """
    folder = minilm_folder()
    pieces = (folder / "vocab.txt").read_text(encoding="utf-8").splitlines()
    table = load_file(folder / "model.safetensors")["embeddings.word_embeddings.weight"]
    rows = {piece: row for row, piece in enumerate(pieces) if re.fullmatch("[a-z]+", piece)}
    chosen = sorted(set(seen) & set(rows))
    chosen += [word for word in rows if word not in set(chosen) and len(word) > 1][: config.words - len(chosen)]
    chosen.sort()
    vectors = table[[rows[word] for word in chosen]].astype(np.float64)
    vectors -= vectors.mean(axis=0)
    _, _, axes = np.linalg.svd(vectors, full_matrices=False)
    components = vectors @ axes[: config.width].T
    spread = components.std(axis=0)
    components /= spread**0.75 * (spread**0.25).mean()
    others = np.random.default_rng(config.seed).normal(size=(len(MASKS) + 1, config.width))
    rounded = np.clip(np.round(np.concatenate((components, others)) / STEP), -CENTRE, CENTRE - 1) * STEP
    return tuple(chosen), rounded.astype(np.float32)


class SpanNetwork(nn.Module):
    """Network of the tagger in floating point; see `SpanTagger`."""

    def __init__(self, table: WordVectors, config: TrainingConfig) -> None:
        super().__init__()
        words, vectors = table
        self.rows = {word: row for row, word in enumerate(words)}
        hidden, moves = config.hidden, len(MOVES)
        self.vectors = nn.Embedding(len(vectors), vectors.shape[1], _weight=torch.from_numpy(vectors), _freeze=True)
        self.groups = nn.EmbeddingBag(BUCKETS, config.letters, mode="mean")
        nn.init.normal_(self.groups.weight, std=0.3)
        self.marks, self.begins = nn.Embedding(len(MARKS), 6), nn.Embedding(2, 4)
        self.rules, self.places = nn.Embedding(moves, 12), nn.Embedding(3, 4)
        self.befores = nn.Embedding(1 + moves, 8)
        inputs = vectors.shape[1] + config.letters + 6 + 4 + 12 + 4 + 8 + SIGNS
        self.convolutions = [
            nn.Conv1d(inputs if layer == 0 else hidden, hidden, KERNEL, padding=dilation, dilation=dilation)
            for layer, dilation in enumerate(DILATIONS)
        ]
        self.registered = nn.ModuleList(self.convolutions)  # torch finds no parameters in a list
        self.pooled = nn.Linear(2 * hidden, hidden)
        self.output = nn.Linear(2 * hidden, LABELS)
        self.pairs = nn.Parameter(torch.zeros(1 + moves, moves))
        self.acted = nn.Linear(2 * hidden, len(ACTIONS))
        self.acted_moves = nn.Parameter(torch.zeros(moves, len(ACTIONS)))
        self.acted_rules = nn.Parameter(2.0 * torch.eye(len(ACTIONS)))
        self.dropout = nn.Dropout(config.dropout)

    def encode(self, batch: Mapping[str, Any]) -> tuple[Tensor, Tensor]:
        """Returns values (b, h, n) of the words and summaries (b, h)."""
        inputs = torch.cat(
            (
                self.vectors(batch["rows"]),
                self.groups(batch["groups"], batch["offsets"]).view(*batch["rows"].shape, -1),
                self.marks(batch["marks"]),
                self.begins(batch["begins"]),
                self.rules(batch["rules"]),
                self.places(batch["places"]),
                self.befores(batch["befores"])[:, None].expand(-1, batch["rows"].shape[1], -1),
                batch["signs"],
            ),
            dim=-1,
        )
        mask = batch["mask"][:, None].float()
        values = self.dropout(inputs).transpose(1, 2) * mask
        for layer, convolution in enumerate(self.convolutions):
            found = F.relu(convolution(self.dropout(values) if layer else values)) * mask
            values = found + values if layer else found
        largest = (values + (mask - 1.0) * 1e4).max(dim=2)[0]
        summary = F.relu(self.pooled(torch.cat((largest, values[:, :, 0]), dim=-1)))
        return values, summary

    def scores(self, values: Tensor, summary: Tensor) -> Tensor:
        """Returns scores (b, n, 2 m) of the labels."""
        both = torch.cat((values, summary[:, :, None].expand(-1, -1, values.shape[2])), dim=1)
        scores: Tensor = self.output(self.dropout(both.transpose(1, 2)))
        return scores

    def action_losses(self, batch: Mapping[str, Any], values: Tensor, summary: Tensor) -> Tensor:
        """Returns the negative log likelihood (b,) of the actions of each sentence's spans."""
        inside = batch["span_words"][:, None].float()  # (s, 1, n)
        sentences, found = batch["span_sentences"], torch.zeros(len(values))
        if len(sentences) == 0:
            return found
        largest = (values[sentences] + (inside - 1.0) * 1e4).max(dim=2)[0]
        scores = self.acted(self.dropout(torch.cat((largest, summary[sentences]), dim=-1)))
        scores = scores + self.acted_moves[batch["span_moves"]] + batch["span_ruled"] @ self.acted_rules
        losses = F.binary_cross_entropy_with_logits(scores, batch["span_named"], reduction="none").sum(dim=1)
        return found.index_add(0, sentences, losses)

    def losses(self, batch: Mapping[str, Any], action_weight: float) -> Tensor:
        """Returns the negative log likelihood (b,) of the labels and, by their weight, the actions of each sentence."""
        values, summary = self.encode(batch)
        scores, mask, labels = self.scores(values, summary), batch["mask"], batch["labels"]
        chosen = scores.gather(2, labels[..., None])[..., 0]
        moves, begun = labels // 2, (labels % 2 == 0) & mask
        joints = self.pairs[1 + moves[:, :-1], moves[:, 1:]] * begun[:, 1:]
        true = self.pairs[0, moves[:, 0]] + (chosen * mask).sum(dim=1) + joints.sum(dim=1)
        begins, insides = scores[:, :, 0::2], scores[:, :, 1::2]
        sums = self.pairs[0] + begins[:, 0]
        for place in range(1, scores.shape[1]):
            begun_here = torch.logsumexp(sums[:, :, None] + self.pairs[1:], dim=1) + begins[:, place]
            grown = torch.logaddexp(begun_here, sums + insides[:, place])
            sums = torch.where(mask[:, place, None], grown, sums)
        losses: Tensor = torch.logsumexp(sums, dim=1) - true
        return losses + action_weight * self.action_losses(batch, values, summary)


def collate(network: SpanNetwork, examples: Sequence[Example], rng: random.Random, forgotten: float) -> dict[str, Any]:
    """Returns a batch of sentences, padded at their ends."""
    size, number = len(examples), max(len(row.labels) for row in examples)
    whole = ("rows", "marks", "begins", "rules", "places", "labels")
    batch: dict[str, Any] = {name: torch.zeros(size, number, dtype=torch.int64) for name in whole}
    batch["mask"] = torch.zeros(size, number, dtype=torch.bool)
    batch["signs"] = torch.zeros(size, number, SIGNS)
    batch["befores"] = torch.zeros(size, dtype=torch.int64)
    groups: list[int] = []
    offsets: list[int] = []
    unknown = len(network.rows) + len(MASKS)
    for at, row in enumerate(examples):
        features, length = row.features, len(row.labels)
        rows = [word_row(word, network.rows) if rng.random() >= forgotten else unknown for word in features.words]
        for name, values in (
            ("rows", rows),
            ("marks", features.marks),
            ("begins", features.begins),
            ("rules", [MOVES.index(move) for move in features.moves]),
            ("labels", row.labels),
            ("mask", [True] * length),
        ):
            batch[name][at, :length] = torch.tensor(values)
        batch["signs"][at, :length] = torch.tensor(features.signs, dtype=torch.float32)
        batch["places"][at, 0] = 1
        batch["places"][at, length - 1] = 2
        batch["befores"][at] = 0 if features.after is None else 1 + MOVES.index(features.after)
        for place in range(number):
            offsets.append(len(groups))
            groups += letter_groups(features.words[place]) if place < length else (0,)
    batch["groups"], batch["offsets"] = torch.tensor(groups), torch.tensor(offsets)
    spans = [(at, span) for at, row in enumerate(examples) for span in row.actions]
    batch["span_sentences"] = torch.tensor([at for at, _ in spans], dtype=torch.int64)
    batch["span_words"] = torch.zeros(len(spans), number, dtype=torch.bool)
    for place, (_, span) in enumerate(spans):
        batch["span_words"][place, span.begin : span.end] = True
    batch["span_moves"] = torch.tensor([MOVES.index(span.move) for _, span in spans], dtype=torch.int64)
    for name in ("ruled", "named"):
        batch[f"span_{name}"] = torch.tensor([getattr(span, name) for _, span in spans], dtype=torch.float32)
    return batch


def train(
    examples: Sequence[Example],
    weights: Sequence[float],
    table: WordVectors,
    config: TrainingConfig,
) -> SpanNetwork:
    """Returns a network trained on weighted sentences, with one thread.

    Args:
        examples: the sentences.
        weights: their weights.
        table: words with their vectors.
        config: settings.
    """
    torch.set_num_threads(1)
    torch.manual_seed(config.seed)
    rng = random.Random(config.seed)
    network = SpanNetwork(table, config)
    parameters = [value for value in network.parameters() if value.requires_grad]
    optimiser = torch.optim.AdamW(parameters, lr=config.rate, weight_decay=1e-4)
    steps = config.epochs * len(_batches(examples, config, random.Random(0)))
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, config.rate, total_steps=steps, pct_start=0.15)
    for _ in range(config.epochs):
        for chosen in _batches(examples, config, rng):
            batch = collate(network, [examples[number] for number in chosen], rng, config.forgotten)
            share = torch.tensor([weights[number] for number in chosen])
            loss = (network.losses(batch, config.action_weight) * share).sum() / share.sum()
            optimiser.zero_grad()
            torch.autograd.backward(loss)
            nn.utils.clip_grad_norm_(parameters, 1.0)
            optimiser.step()
            schedule.step()
    network.eval()
    return network


def _batches(examples: Sequence[Example], config: TrainingConfig, rng: random.Random) -> list[list[int]]:
    """Returns the numbers of the sentences by batch, those of similar length together."""
    order = list(range(len(examples)))
    rng.shuffle(order)
    room = 40 * config.batch
    found = []
    for start in range(0, len(order), room):
        part = sorted(order[start : start + room], key=lambda number: len(examples[number].labels))
        found += [part[at : at + config.batch] for at in range(0, len(part), config.batch)]
    rng.shuffle(found)
    return found


def packed(network: SpanNetwork) -> bytes:
    """Returns the weights file: whole numbers with as many binary places as their largest needs."""
    arrays: dict[str, NDArray[Any]] = {
        "words": _text(network.rows),
        "moves": _text(move.label for move in MOVES),
        "vectors": _nibbles(network.vectors.weight),
    }
    for name in ("groups", "marks", "begins", "rules", "places", "befores"):
        arrays[name] = _whole(getattr(network, name).weight, INPUT_BITS)
    shifts = []
    for layer, convolution in enumerate(network.convolutions):
        kernel = convolution.weight.permute(2, 1, 0)
        bits, places = _bits(kernel), INPUT_BITS if layer == 0 else HIDDEN_BITS
        arrays[f"convolution{layer}"] = _whole(kernel, bits)
        arrays[f"bias{layer}"] = _whole(cast("Tensor", convolution.bias), bits + places, np.int32)
        shifts.append(bits + places - HIDDEN_BITS)
    bits = _bits(network.pooled.weight)
    arrays["pooled"] = _whole(network.pooled.weight.T, bits)
    arrays["pooled_bias"] = _whole(network.pooled.bias, bits + HIDDEN_BITS, np.int32)
    bits_out = _bits(network.output.weight)
    arrays["output"] = _whole(network.output.weight.T, bits_out)
    arrays["output_bias"] = _whole(network.output.bias, bits_out + HIDDEN_BITS, np.int32)
    arrays["pairs"] = _whole(network.pairs, bits_out + HIDDEN_BITS, np.int32)
    arrays["shifts"] = np.array([*shifts, bits], np.int32)
    bits_acted = _bits(network.acted.weight)
    arrays["acted"] = _whole(network.acted.weight.T, bits_acted)
    arrays["acted_bias"] = _whole(network.acted.bias, bits_acted + HIDDEN_BITS, np.int32)
    for name in ("acted_moves", "acted_rules"):
        arrays[name] = _whole(getattr(network, name), bits_acted + HIDDEN_BITS, np.int32)
    arrays["scale"] = np.array([bits_out + HIDDEN_BITS, bits_acted + HIDDEN_BITS], np.int32)
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays)
    return file.getvalue()


def _text(lines: Iterable[str]) -> NDArray[np.uint8]:
    return np.frombuffer("\n".join(lines).encode(), np.uint8)


def _nibbles(vectors: Tensor) -> NDArray[np.uint8]:
    whole = np.round(vectors.detach().numpy() / STEP).astype(np.int64) + CENTRE
    return (whole[:, 0::2] + 16 * whole[:, 1::2]).astype(np.uint8)


def _bits(weights: Tensor) -> int:
    """Returns the binary places with which the largest weight still has eight bits."""
    return int(np.floor(np.log2(127.0 / float(weights.detach().abs().max()))))


def _whole(weights: Tensor, bits: int, kind: type[np.signedinteger[Any]] = np.int8) -> NDArray[Any]:
    limits = np.iinfo(kind)
    rounded = np.round(weights.detach().double().numpy() * 2.0**bits)
    return np.ascontiguousarray(np.clip(rounded, limits.min, limits.max).astype(kind))


def training_examples(sentences: Sequence[Sentence], config: TrainingConfig) -> tuple[list[Example], list[float]]:
    """Returns examples of sentences, their variants and compositions, and of the grammar, with their weights."""
    rng, noise = random.Random(config.seed), np.random.default_rng(config.seed)
    rows = [row for sentence in sentences for row in (sentence, *variants(sentence, rng, noise))]
    composed = list(compositions(sentences, config.composed, rng))
    rows += composed
    rows += [variants(sentence, rng, noise)[-1] for sentence in composed[: config.composed // 3]]
    sampled = grammar_sentences(config.sampled, config.seed)
    weights = [1.0] * len(rows) + [config.grammar_weight] * len(sampled)
    return [example(sentence) for sentence in (*rows, *sampled)], weights


Shares = tuple[float, float, float]


def compare(data: bytes, examples: Sequence[Example]) -> tuple[Shares, Shares]:
    """Returns the shares of right first moves, cuts and sequences of moves: by the rules, and with the tagger."""
    tagger = unpack(data)
    ruled, tagged = [], []
    for row in examples:
        by_rules = [
            2 * MOVES.index(move) + (not begins)
            for move, begins in zip(row.features.moves, row.features.begins, strict=True)
        ]
        labels, best, said = tagger.tag(row.features, *tagger.encode(row.features))
        ruled.append(by_rules)
        tagged.append(labels if best - said > tagger.margin else by_rules)
    return _shares(ruled, examples), _shares(tagged, examples)


def _shares(found: Sequence[Sequence[int]], examples: Sequence[Example]) -> Shares:
    first = cuts = moves = 0
    for labels, row in zip(found, examples, strict=True):
        begun, wanted = ([at for at, label in enumerate(each) if label % 2 == 0] for each in (labels, row.labels))
        first += labels[0] == row.labels[0]
        cuts += begun == wanted
        moves += [labels[at] for at in begun] == [row.labels[at] for at in wanted]
    return first / len(examples), cuts / len(examples), moves / len(examples)


def _print(name: str, data: bytes, examples: Sequence[Example]) -> None:
    rules, tagger = (" ".join(f"{100 * share:5.1f}" for share in shares) for shares in compare(data, examples))
    print(f"{name:24} {len(examples):5}  rules {rules}  tagger {tagger}", flush=True)


def validate(sentences: Sequence[Sentence], folds: int, table: WordVectors, config: TrainingConfig) -> None:
    """Prints first moves, cuts and sequences of moves [%] of sentences that were not trained on, by fold."""
    people = [example(sentence) for sentence in read_training_sentences(FOLDER / "sentences.jsonl", split="dev")]
    noise = np.random.default_rng(1)
    for fold in range(folds):
        held = [sentence for number, sentence in enumerate(sentences) if number // 5 % folds == fold]
        kept = [sentence for number, sentence in enumerate(sentences) if number // 5 % folds != fold]
        data = packed(train(*training_examples(kept, config), table, config))
        _print(f"fold {fold}", data, [example(sentence) for sentence in held])
        misheard = [variants(sentence, random.Random(fold), noise)[-1] for sentence in held]
        _print(f"fold {fold}, misheard", data, [example(sentence) for sentence in misheard])
        _print("people, dev", data, people)


def _seen(sentences: Iterable[Sentence]) -> set[str]:
    return {word.strip(".,?!").lower() for sentence in sentences for word in sentence.text.split()}


def main() -> None:
    """Trains on all sentences, or cross-validates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folds", type=int, default=0, help="folds of the cross-validation; 0 trains the weights")
    parser.add_argument("--out", type=Path, default=TARGET)
    parser.add_argument("--minilm", action="store_true", help="make the vectors of words from MiniLM")
    asked = parser.parse_args()
    if asked.folds == 1 or asked.folds < 0:
        parser.error(f"--folds is {asked.folds}; give at least 2, or 0 to train the weights")
    sentences, config = read_training_sentences(), TrainingConfig()
    table = minilm_vectors(_seen(sentences), config) if asked.minilm else shipped_vectors()
    if asked.folds:
        validate(sentences, asked.folds, table, config)
        return
    data = packed(train(*training_examples(sentences, config), table, config))
    write_atomically(asked.out, data)
    print(f"{asked.out}: {len(data):,} bytes")


if __name__ == "__main__":
    main()
