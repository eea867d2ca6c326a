"""Training in rounds (DAgger): imitation of a corpus, then rounds of practice with the teacher.

A round plays sessions in which the previous round's player and the teacher alternate, adds the teacher's
decisions to the examples, and fits the network again (Ross, Gordon and Bagnell, AISTATS 2011). The examples of each
session and the model of each fit are saved, so that an interrupted training can be resumed; all depend only on the
seed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Final, Protocol, TypeVar

import numpy as np

from dorothie_gym.archive.corpus import Corpus
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout.folder import locked_folder
from dorothie_gym.evaluation.rollout.processes import run_tasks
from dorothie_gym.maps.folds import SEEN_TOWNS

SETTINGS_FILE: Final = "training.json"
LESSONS: Final = "lessons"
"""Folder with a file for each session."""

OnStage = Callable[[str, int, int], None]
"""Callback with the name of a stage, the number of its steps done, and their total."""


@dataclass(frozen=True, kw_only=True)
class RoundSettings:
    """Settings of a training in rounds.

    Attributes:
        corpus: folder of the corpus, whose fold `train` is imitated.
        seed: seed of the network, of the order of the examples, and of the practice.
        rounds: number of rounds of practice.
        sessions: sessions of practice in a round.
        share: share of the time in which the player acts in practice.
        max_seconds: time limit of a session of practice [s].
        first_epochs: passes of the fit to the corpus.
        epochs: passes of the fit after each round, which continues the previous fit.
        last_epochs: passes of the last fit.
        least: minimum number of occurrences of a remark in the corpus for it to be learnt.
    """

    corpus: Path
    seed: int = 0
    rounds: int = 3
    sessions: int = 25
    share: float = 0.6
    max_seconds: float = 300.0
    first_epochs: int = 8
    epochs: int = 4
    last_epochs: int = 8
    least: int = 3

    def __post_init__(self) -> None:
        """Checks the fields."""
        for name, low in (("seed", 0), ("rounds", 0), ("sessions", 1), ("first_epochs", 1), ("epochs", 1)):
            if getattr(self, name) < low:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be at least {low}")

    def as_json(self) -> dict[str, object]:
        """Returns the settings as JSON types."""
        return {**asdict(self), "corpus": str(self.corpus)}


@dataclass(frozen=True, kw_only=True)
class FinishedFit:
    """A fit: the name of its model's folder, its number of examples, and the mean loss of its last pass [nats]."""

    name: str
    examples: int
    loss: float


@dataclass(frozen=True, kw_only=True)
class CorpusPlan:
    """Session of the corpus to be simulated again: its number in the fold, and the file of its lessons."""

    number: int
    file: Path


@dataclass(frozen=True, kw_only=True)
class PracticePlan:
    """Practice session: its number in the round, town, seed, and the file of its examples."""

    number: int
    town: str
    seed: int
    file: Path


@dataclass(frozen=True, kw_only=True)
class FitPlan:
    """A fit.

    Attributes:
        number: number of the round; 0 for the fit to the corpus.
        folder: folder of its model.
        files: files of lessons.
        corpus_files: those of the files that belong to the corpus, from which the vocabulary is taken.
        former: folder of the previous model, from which the fit continues; None for the first fit.
        epochs: number of passes.
        title: name of the stage.
    """

    number: int
    folder: Path
    files: Sequence[Path]
    corpus_files: Sequence[Path]
    former: Path | None
    epochs: int
    title: str


class Learner(Protocol):
    """Role-specific parts of the training."""

    @property
    def branch(self) -> int:
        """Branch of the seed from which the sessions of the practice are drawn; no rollout or corpus draws from it."""
        ...

    @property
    def at_once(self) -> int:
        """Largest number of sessions of practice that are played at the same time."""
        ...

    def follower(self) -> Callable[[Sequence[CorpusPlan]], None]:
        """Returns the function that writes the examples of corpus sessions; it may skip a session."""
        ...

    def player(self, folder: Path) -> Callable[[Sequence[PracticePlan]], None]:
        """Returns the function that plays sessions with the model in a folder, and writes their lessons."""
        ...

    def fit(self, plan: FitPlan, on_stage: OnStage) -> FinishedFit:
        """Fits a network, and saves the model."""
        ...


def train_in_rounds(
    learner: Learner,
    settings: RoundSettings,
    out: Path,
    *,
    workers: int,
    on_stage: OnStage,
    lessons: Path | None = None,
) -> tuple[FinishedFit, ...]:
    """Trains a model; a started training is resumed.

    Args:
        learner: functions of the role; it is sent to the workers.
        settings: settings.
        out: folder; it receives `model.json` and `model.safetensors`, the lessons, and the model of each round.
        workers: number of processes that play sessions; the result does not depend on it.
        on_stage: callback for the progress.
        lessons: folder of the corpus's training examples, which trainings with other seeds may share; None for one in
            `out`.

    Returns:
        The fits that were done now.

    Raises:
        SessionError: the corpus cannot be read or replayed, or the folder contains other files.
        ProcessError: a session failed in another process.
    """
    done: list[FinishedFit] = []
    entries = Corpus.load(settings.corpus).filter(fold="train").entries
    if not entries:
        raise SessionError(f"{settings.corpus}: there is no session in the fold 'train' to learn from")
    with locked_folder(out, SETTINGS_FILE, settings.as_json()):
        shared = lessons or out / LESSONS / "corpus"
        paths = [shared / f"{entry.path.name}.safetensors" for entry in entries]
        plans = [CorpusPlan(number=k, file=path) for k, path in enumerate(paths)]
        with locked_folder(shared, SETTINGS_FILE, {"corpus": str(settings.corpus)}):
            gather(learner.follower, plans, workers, partial(on_stage, "Sessions of the corpus"))
        corpus_files = [path for path in paths if path.is_file()]
        if not corpus_files:
            raise SessionError(f"{settings.corpus}: fold 'train' has no session to learn from")
        files, former = list(corpus_files), None
        for number in range(settings.rounds + 1):
            folder = out if number == settings.rounds else out / f"round-{number}"
            if former is not None:
                place = out / LESSONS / f"practice-{number}"
                practice = practice_plans([settings.seed, number], settings.sessions, learner.branch, place)
                title = f"Practice, round {number} of {settings.rounds}"
                report = partial(on_stage, title)
                gather(partial(learner.player, former), practice, workers, report, at_once=learner.at_once)
                files += [plan.file for plan in practice]
            if not (folder / "model.json").is_file():
                done.append(learner.fit(_fit_plan(settings, number, folder, files, corpus_files, former), on_stage))
            former = folder
    return tuple(done)


def _fit_plan(
    settings: RoundSettings,
    number: int,
    folder: Path,
    files: Sequence[Path],
    corpus_files: Sequence[Path],
    former: Path | None,
) -> FitPlan:
    last = number == settings.rounds
    epochs = settings.first_epochs if former is None else settings.last_epochs if last else settings.epochs
    title = "Fit to the corpus" if former is None else f"Fit, round {number} of {settings.rounds}"
    return FitPlan(
        number=number, folder=folder, files=files, corpus_files=corpus_files, former=former, epochs=epochs, title=title
    )


def practice_plans(seeds: Sequence[int], sessions: int, branch: int, folder: Path) -> list[PracticePlan]:
    """Returns the sessions of a round; the seen towns take turns.

    Args:
        seeds: seed of the training, and number of the round.
        sessions: number of sessions.
        branch: branch of the seed, see `Learner.branch`.
        folder: folder of the files.
    """
    return [
        PracticePlan(
            number=k,
            town=SEEN_TOWNS[k % len(SEEN_TOWNS)],
            seed=int(np.random.SeedSequence([*seeds, k, branch]).generate_state(1)[0] >> 1),
            file=folder / f"{k:04d}.safetensors",
        )
        for k in range(sessions)
    ]


def processor_seconds() -> float:
    """Returns the processor time of this process and of its finished child processes [s]."""
    return sum(os.times()[:4])


Plan = TypeVar("Plan", CorpusPlan, PracticePlan)


def gather(
    prepare: Callable[[], Callable[[Sequence[Plan]], None]],
    plans: Sequence[Plan],
    workers: int,
    report: Callable[[int, int], None],
    *,
    at_once: int = 1,
) -> None:
    """Creates the missing files of sessions, of which several may be played at the same time."""
    missing = [plan for plan in plans if not plan.file.is_file()]
    size = max(1, min(at_once, len(missing) // workers))
    batches = [tuple(missing[first : first + size]) for first in range(0, len(missing), size)]
    done = len(plans) - len(missing)
    report(done, len(plans))
    for _ in run_tasks(prepare, batches, workers=workers):
        done = min(done + size, len(plans))
        report(done, len(plans))
