"""Training and inference speed of TOTO at the published size, against the published loop and the matrix rate."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import torch
from torch import Tensor
from torch.utils.flop_counter import FlopCounterMode

from benchmarks.published_toto import Features, PublishedTOTO, Senses, rebuild, train_step
from benchmarks.timing import Progress, alternate, cpu_seconds, ignore_progress, machine, rounded
from dorothie_gym.archive import Corpus
from dorothie_gym.archive.prediction_points import Point, task_points
from dorothie_gym.baselines.gradients import backpropagate
from dorothie_gym.baselines.point_tensors import TASKS, Examples, Labels
from dorothie_gym.baselines.toto import TOTO, FrozenTexts, TOTOConfig, Towns
from dorothie_gym.evaluation.teacher_forced.features import Columns, build, points
from dorothie_gym.session.recording import Session
from dorothie_gym.support.processors import available_processors

_POINTS: Final = 512
"""Points of the corpus that are looked at."""

_SIDE: Final = 2048
"""Rows and columns of the matrices of the matrix rate."""

_ONE_BY_ONE: Final = 4
"""Points of the published loop in a repeat of its training; it answers three times as many."""


def measure(
    corpus: Path,
    *,
    threads: int | None = None,
    batch_size: int = 64,
    repeats: int = 5,
    progress: Progress = ignore_progress,
) -> dict[str, object]:
    """Measures points a second in training and in answering, ours and the published loop's in turns.

    Both have the same inputs and widths (`TOTOConfig.published`), in float32 on the CPU.

    Args:
        corpus: folder of sessions.
        threads: number of torch threads; None takes all cores. With one, CPU time is measured, which other programs
            disturb little.
        batch_size: points of one of our steps.
        repeats: how often each is measured; the median counts.
        progress: called with the name of each measurement and the share done.

    Raises:
        SessionError: the corpus cannot be read.
    """
    before = torch.get_num_threads()
    threads = threads or available_processors()
    torch.set_num_threads(threads)
    torch.manual_seed(0)
    timed = cpu_seconds if threads == 1 else _wall_seconds
    try:
        progress("features", 0.0)
        columns = build(corpus)
        senses = Senses()
        ours, batch = _ours(columns, senses, batch_size)
        published, turns = _published(corpus, columns, senses)
        flops = _flops(ours, batch)
        ours_optimiser = torch.optim.AdamW(ours.parameters(), lr=1e-5, weight_decay=1e-4, fused=True)
        published_optimiser = torch.optim.AdamW(published.parameters(), lr=1e-5, weight_decay=1e-4)
        left, right = torch.randn(_SIDE, _SIDE), torch.randn(_SIDE, _SIDE)
        works: dict[str, Callable[[], float]] = {
            "matrix rate": lambda: timed(lambda: [left @ right for _ in range(4)]) / 4,
            "training": lambda: timed(lambda: _train(ours, ours_optimiser, batch)) / batch_size,
            "published training": lambda: (
                timed(lambda: _train_published(published, published_optimiser, turns)) / _ONE_BY_ONE
            ),
            "inference": lambda: timed(lambda: _answer(ours, batch)) / batch_size,
            "published inference": lambda: timed(lambda: _answer_published(published, turns)) / (3 * _ONE_BY_ONE),
        }
        for work in works.values():
            work()  # memory is taken the first time
        timing = alternate(works, repeats, progress)
    finally:
        torch.set_num_threads(before)
    rates = {name: one.rate for name, one in timing.items()}
    matrix = 2.0 * _SIDE**3 * rates["matrix rate"]
    return {
        "points_per_second": rounded(rates["training"]),
        "published_points_per_second": rounded(rates["published training"]),
        "ratio": rounded(rates["training"] / rates["published training"]),
        "spread": timing["training"].spread,
        "published_spread": timing["published training"].spread,
        "best": rounded(timing["training"].best),
        "published_best": rounded(timing["published training"].best),
        "inference_points_per_second": rounded(rates["inference"]),
        "published_inference_points_per_second": rounded(rates["published inference"]),
        "inference_ratio": rounded(rates["inference"] / rates["published inference"]),
        "flops_per_point": rounded(flops / batch_size),
        "flops_per_second": rounded(flops / batch_size * rates["training"]),
        "matrix_flops_per_second": rounded(matrix),
        "matrix_share": rounded(flops / batch_size * rates["training"] / matrix),
        "parameters": _size(ours),
        "published_parameters": _size(published),
        "batch_size": batch_size,
        "tokens": ours.token_count(batch[0]),
        "threads": threads,
        "repeats": repeats,
        "torch": torch.__version__,
        "machine": machine(),
    }


Batch = tuple[dict[str, Tensor], Labels]


def _ours(columns: Columns, senses: Senses, batch_size: int) -> tuple[TOTO, Batch]:
    """Returns TOTO, and a batch with random image, sound and detector features."""
    config = TOTOConfig.published()
    tables = [points(columns, task) for task in TASKS]
    examples = Examples.gather(columns, tables, config.spec)
    step = max(1, len(examples) // batch_size)
    inputs, labels = examples.take(torch.arange(batch_size) * step % len(examples))
    tenth = (inputs["window_time"] * 10).long().clamp(min=0)
    now = (inputs["time"] * 10).long()
    inputs["window_image"] = senses.images[tenth % senses.rows]
    inputs["current_sound"] = senses.sounds[now % senses.rows]
    inputs["detector"] = senses.queries[now % len(senses.queries)]
    words = senses.words[torch.arange(len(columns.texts)) % senses.rows]
    return TOTO(config, Towns(columns.towns), FrozenTexts(words)), (inputs, labels)


Turn = Callable[[], tuple[Session, Point]]


class _Turns:
    """Endless sequence of the points of some sessions, in the order of the published loop."""

    def __init__(self, sessions: Sequence[Session], columns: Columns, senses: Senses):
        town = dict(zip(columns.sessions.names, columns.sessions.town.tolist(), strict=True))
        self._graphs = {session.name: columns.towns[town[session.name]] for session in sessions}
        self._senses = senses
        found = [(session, point) for session in sessions for task in TASKS for point in task_points(session, task)]
        step = max(1, len(found) // _POINTS)
        order = torch.randperm(len(found), generator=torch.Generator().manual_seed(0)).tolist()
        self._points = itertools.cycle([found[place] for place in order[::step]])

    def next(self) -> tuple[Features, Point]:
        """Returns the next point with its features, rebuilt."""
        session, point = next(self._points)
        return rebuild(session, point.view, self._graphs[session.name], self._senses), point


def _published(corpus: Path, columns: Columns, senses: Senses) -> tuple[PublishedTOTO, _Turns]:
    entries = Corpus.load(corpus).entries[:4]
    return PublishedTOTO(), _Turns([entry.load() for entry in entries], columns, senses)


def _train(model: TOTO, optimiser: torch.optim.Optimizer, batch: Batch) -> None:
    model.train()
    optimiser.zero_grad(set_to_none=True)
    loss = model.loss(*batch)
    backpropagate(loss)
    torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
    optimiser.step()


def _train_published(model: PublishedTOTO, optimiser: torch.optim.Optimizer, turns: _Turns) -> None:
    model.train()
    for _ in range(_ONE_BY_ONE):
        given, point = turns.next()
        train_step(model, optimiser, given, point)


def _answer(model: TOTO, batch: Batch) -> None:
    model.eval()
    with torch.inference_mode():
        model.predict(batch[0], batch[1].task)


def _answer_published(model: PublishedTOTO, turns: _Turns) -> None:
    model.eval()
    with torch.inference_mode():
        for _ in range(3 * _ONE_BY_ONE):
            given, point = turns.next()
            model.loss(given, point)


def _flops(model: TOTO, batch: Batch) -> float:
    """Multiplications and additions of the matrix products of one step, forward and backward."""
    model.train()
    counter = FlopCounterMode(display=False)
    with counter:
        backpropagate(model.loss(*batch))
    return float(counter.get_total_flops())


def _wall_seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def _size(model: torch.nn.Module) -> int:
    return sum(weights.numel() for weights in model.parameters())
