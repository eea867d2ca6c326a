"""Training of the learned Co-Wizard: imitation of a corpus, then rounds of practice beside the teacher (DAgger).

A round plays sessions in which the player of the round before and the teacher drive in turns, adds the teacher's
decisions to the examples, and fits the network again (Ross, Gordon and Bagnell, AISTATS 2011). Each session is a file
of lessons, and each fit a model, so that an interrupted training goes on where it was; all follow from the seed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np
import torch

from dorothie_gym.baselines.co_wizard.demonstrations import follow, is_held_out, practise
from dorothie_gym.baselines.co_wizard.examples import Example
from dorothie_gym.baselines.co_wizard.files import (
    KIND,
    MODEL_FORMAT,
    ModelPage,
    load_network,
    read_lessons,
    save_network,
    vocabulary_of,
    write_lessons,
)
from dorothie_gym.baselines.co_wizard.fitting import fit
from dorothie_gym.baselines.co_wizard.network import CoWizardNetwork, Layout
from dorothie_gym.baselines.co_wizard.policy import LearnedCoWizard
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.errors import SessionError
from dorothie_gym.maps import SEEN_TOWNS
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.recording import Corpus
from dorothie_gym.rollout.folder import locked_folder
from dorothie_gym.rollout.processes import run_tasks

SETTINGS_FILE: Final = "training.json"
LESSONS, CORPUS = "lessons", "corpus"
"""Folder with a file for each session, and that of the sessions of the corpus in it."""

_PRACTICE: Final = 29
"""Branch of the seed from which the sessions of the practice are drawn; no rollout or corpus draws from it."""

OnStage = Callable[[str, int, int], None]
"""Callback with the name of a stage, the number of its steps done, and their total."""


@dataclass(frozen=True, kw_only=True)
class CoWizardTraining:
    """Settings of a training.

    Attributes:
        corpus: folder of the corpus, whose fold `train` is imitated.
        seed: seed of the network, of the order of the examples, and of the practice.
        rounds: number of rounds of practice.
        sessions: sessions of practice in a round.
        share: share of the time in which the player drives in practice.
        talking: share of that time in which it also talks.
        max_seconds: time limit of a session of practice [s].
        first_epochs: passes of the fit to the corpus.
        epochs: passes of the fit after each round, which goes on from the one before.
        last_epochs: passes of the last fit.
        least: number of times that a remark must occur in the corpus to be learnt.
    """

    corpus: Path
    seed: int = 0
    rounds: int = 5
    sessions: int = 30
    share: float = 0.6
    talking: float = 0.5
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
        """Returns the settings in JSON types."""
        return {**asdict(self), "corpus": str(self.corpus)}


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A fit: the name of its model's folder, its number of examples, and the mean loss of its last pass [nats]."""

    name: str
    examples: int
    loss: float


def train_co_wizard(
    settings: CoWizardTraining, out: Path, *, workers: int, on_stage: OnStage, lessons: Path | None = None
) -> tuple[Stage, ...]:  # fmt: skip
    """Trains a Co-Wizard; a started training is resumed.

    Args:
        settings: settings.
        out: folder; it receives `model.json` and `model.safetensors`, the lessons, and the model of each round.
        workers: number of processes that play sessions; the result does not depend on it.
        on_stage: callback for the progress.
        lessons: folder of the lessons of the corpus, which trainings with other seeds may share; None for one in `out`.

    Returns:
        The fits that were done now.

    Raises:
        SessionError: the corpus cannot be read or replayed, or the folder holds something else.
        ProcessError: a session failed in another process.
    """
    torch.set_num_threads(1)  # small layers: more threads only wait for each other, and change the last bits
    begun, done = _processor_seconds(), []
    entries = Corpus.load(settings.corpus).filter(fold="train").entries
    if not entries:
        raise SessionError(f"{settings.corpus}: there is no session in the fold 'train' to learn from")
    with locked_folder(out, SETTINGS_FILE, settings.as_json()):
        corpus_lessons = out / LESSONS / CORPUS if lessons is None else lessons
        with locked_folder(corpus_lessons, SETTINGS_FILE, {"corpus": str(settings.corpus)}):
            paths = [corpus_lessons / f"{entry.path.name}.safetensors" for entry in entries]
            plans = [CorpusPlan(number=k, file=path) for k, path in enumerate(paths)]
            _gather(partial(_Follower, settings.corpus), plans, workers, partial(on_stage, "Sessions of the corpus"))
        files = [path for path in paths if path.is_file()]
        if not files:
            raise SessionError(f"{settings.corpus}: fold 'train' has no session to learn from")
        vocabulary = vocabulary_of(files, settings.least)
        for number in range(settings.rounds + 1):
            folder = out if number == settings.rounds else out / f"round-{number}"
            if number:
                player = out / f"round-{number - 1}"
                practice = _practice(settings, number, out)
                title = f"Practice, round {number} of {settings.rounds}"
                _gather(partial(_Player, player, settings), practice, workers, partial(on_stage, title))
                files += [plan.file for plan in practice]
            if (folder / "model.json").is_file():
                continue
            former = load_network(out / f"round-{number - 1}")[0] if number else None
            stage = _fit(settings, number, folder, files, vocabulary, former, begun, on_stage)
            done.append(stage)
    return tuple(done)


def _processor_seconds() -> float:
    """Returns the processor time of this process and of those that have ended [s]."""
    return sum(os.times()[:4])


def _fit(
    settings: CoWizardTraining, number: int, folder: Path, files: Sequence[Path], vocabulary: tuple[str, ...],
    former: CoWizardNetwork | None, begun: float, on_stage: OnStage,
) -> Stage:  # fmt: skip
    """Fits a network to the lessons in some files, and saves it."""
    examples = read_lessons(files, vocabulary)
    torch.manual_seed(settings.seed)
    network = CoWizardNetwork(Layout.of(len(vocabulary))) if former is None else former
    last = number == settings.rounds
    epochs = settings.first_epochs if former is None else settings.last_epochs if last else settings.epochs
    title = "Fit to the corpus" if former is None else f"Fit, round {number} of {settings.rounds}"
    on_stage(title, 0, epochs)
    seed = settings.seed * 1000 + number
    loss = fit(network, examples, epochs=epochs, seed=seed, on_epoch=lambda epoch, _: on_stage(title, epoch, epochs))
    page = ModelPage(
        format=MODEL_FORMAT, kind=KIND, layout=network.layout, vocabulary=vocabulary, steps=len(examples) * epochs,
        seconds=round(_processor_seconds() - begun, 1),
        settings={**settings.as_json(), "corpus": settings.corpus.name},
    )  # fmt: skip
    save_network(network, page, folder)
    return Stage(name=folder.name, examples=len(examples), loss=loss)


# --- Sessions ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class CorpusPlan:
    """Session of the corpus to be followed: its number in the fold, and the file of its lessons."""

    number: int
    file: Path


@dataclass(frozen=True, kw_only=True)
class PracticePlan:
    """Session of practice: town, seed, and the file of its lessons."""

    town: str
    seed: int
    file: Path


def _practice(settings: CoWizardTraining, number: int, out: Path) -> list[PracticePlan]:
    """Returns the sessions of a round; the seen towns take turns."""
    return [
        PracticePlan(
            town=SEEN_TOWNS[k % len(SEEN_TOWNS)],
            seed=int(np.random.SeedSequence([settings.seed, number, k, _PRACTICE]).generate_state(1)[0] >> 1),
            file=out / LESSONS / f"practice-{number}" / f"{k:04d}.safetensors",
        )
        for k in range(settings.sessions)
    ]


def _gather(
    prepare: Callable[[], Callable[[CorpusPlan], None]] | Callable[[], Callable[[PracticePlan], None]],
    plans: Sequence[CorpusPlan] | Sequence[PracticePlan], workers: int, report: Callable[[int, int], None],
) -> None:  # fmt: skip
    """Makes the missing files of lessons."""
    missing = [plan for plan in plans if not plan.file.is_file()]
    report(len(plans) - len(missing), len(plans))
    for number, _ in enumerate(run_tasks(prepare, missing, workers=workers), start=len(plans) - len(missing) + 1):  # type: ignore[arg-type]
        report(number, len(plans))


class _Follower:
    """Follows sessions of a corpus; those with a held-out participant are left out."""

    def __init__(self, corpus: Path) -> None:
        torch.set_num_threads(1)
        self._entries = Corpus.load(corpus).filter(fold="train").entries

    def __call__(self, plan: CorpusPlan) -> None:
        entry = self._entries[plan.number]
        session = entry.load()
        if is_held_out(session.header):
            return
        town = find_town(session.header.town, entry.maps)
        if town is None:
            raise SessionError(f"{session.name}: there is no map of {session.header.town}; it cannot be replayed")
        found: list[Example] = []
        follow(session, town, found.append)
        _write(found, plan.file)


class _Player:
    """Plays sessions of practice."""

    def __init__(self, folder: Path, settings: CoWizardTraining) -> None:
        torch.set_num_threads(1)
        self._network, page = load_network(folder)
        self._vocabulary, self._settings = page.vocabulary, settings
        self._config = EnvConfig(max_seconds=settings.max_seconds)
        self._engines: dict[str, SessionEngine] = {}

    def __call__(self, plan: PracticePlan) -> None:
        engine = self._engines.setdefault(plan.town, SessionEngine(plan.town, config=self._config))
        player = LearnedCoWizard(self._network, self._vocabulary, engine.limits)
        found: list[Example] = []
        share, talking = self._settings.share, self._settings.talking
        practise(player, engine, plan.seed, found.append, share=share, talking=talking)
        _write(found, plan.file)


def _write(found: Sequence[Example], file: Path) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    write_lessons(found, file)
