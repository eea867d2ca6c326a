"""Training of a learned role: imitation of a corpus, then rounds of practice beside the scripted role."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

import torch
from torch import nn

from dorothie_gym.archive.corpus import Corpus
from dorothie_gym.baselines.roles.learned_role.dagger import (
    CorpusPlan,
    FinishedFit,
    FitPlan,
    OnStage,
    PracticePlan,
    RoundSettings,
    processor_seconds,
    train_in_rounds,
)
from dorothie_gym.baselines.roles.learned_role.dagger_sessions import PracticeSession, is_held_out
from dorothie_gym.baselines.roles.learned_role.examples import ExampleBatch, forms_in
from dorothie_gym.baselines.roles.learned_role.model_files import ModelFiles
from dorothie_gym.baselines.roles.learned_role.supervised import fit
from dorothie_gym.errors import SessionError
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.maps.town import Town
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.session_engine import SessionEngine

Network = TypeVar("Network", bound=nn.Module)
Batch = TypeVar("Batch", bound=ExampleBatch[Any])
Example = TypeVar("Example")
Settings = TypeVar("Settings", bound=RoundSettings)


@dataclass(frozen=True, kw_only=True)
class LearnedRole(Generic[Network, Batch, Example, Settings]):
    """Role that can be trained: its files, network, examples and loss.

    Attributes:
        files: files and network of its models.
        examples: class of its examples.
        loss: loss of a network in the given examples [nats].
        follow: simulates a recorded session again, and hands on the examples of the role.
        practise: plays sessions in which a network with a vocabulary and the teacher alternate, and hands on the
            teacher's decisions.
        branch: branch of the seed from which the sessions of practice are drawn; no rollout or corpus draws from it.
        at_once: largest number of sessions of practice that are played at the same time.
    """

    files: ModelFiles[Network]
    examples: type[Batch]
    loss: Callable[[Network, Batch], torch.Tensor]
    follow: Callable[[Session, Town, Callable[[Example], None]], None]
    practise: Callable[[Network, Sequence[str], Sequence[PracticeSession[Example]], Settings], None]
    branch: int
    at_once: int = 1


def train_role(
    role: LearnedRole[Network, Batch, Example, Settings],
    settings: Settings,
    out: Path,
    *,
    workers: int,
    on_stage: OnStage,
    lessons: Path | None = None,
) -> tuple[FinishedFit, ...]:
    """Trains a role; a started training is resumed. See `train_in_rounds`."""
    torch.set_num_threads(1)  # small layers: more threads only wait for each other, and change the last bits
    learner = RoleLearner(role=role, settings=settings)
    return train_in_rounds(learner, settings, out, workers=workers, on_stage=on_stage, lessons=lessons)


@dataclass(frozen=True, kw_only=True)
class RoleLearner(Generic[Network, Batch, Example, Settings]):
    """Functions of the training of a role, see `dagger.Learner`.

    Attributes:
        role: the role.
        settings: settings of the training.
        begun: processor time at the start of the training [s].
    """

    role: LearnedRole[Network, Batch, Example, Settings]
    settings: Settings
    begun: float = field(default_factory=processor_seconds)

    @property
    def branch(self) -> int:
        """Branch of the seed from which the sessions of the practice are drawn."""
        return self.role.branch

    @property
    def at_once(self) -> int:
        """Largest number of sessions of practice that are played at the same time."""
        return self.role.at_once

    def follower(self) -> Callable[[Sequence[CorpusPlan]], None]:
        """Returns the function that follows sessions; those of held-out personas are left out."""
        torch.set_num_threads(1)
        return partial(self._follow, Corpus.load(self.settings.corpus).filter(fold="train"))

    def player(self, folder: Path) -> Callable[[Sequence[PracticePlan]], None]:
        """Returns the function that plays sessions of practice."""
        return _PracticeSessions(self.role, folder, self.settings)

    def fit(self, plan: FitPlan, on_stage: OnStage) -> FinishedFit:
        """Fits a network to lessons, and saves it."""
        settings, role = self.settings, self.role
        vocabulary = role.examples.vocabulary_of(plan.corpus_files, settings.least)
        examples = role.examples.read(plan.files, vocabulary)
        torch.manual_seed(settings.seed)
        if plan.former is None:
            network = role.files.network(len(vocabulary))
        else:
            network, _ = role.files.load(plan.former)
        on_stage(plan.title, 0, plan.epochs)
        loss = fit(
            network,
            examples,
            partial(role.loss, network),
            epochs=plan.epochs,
            seed=settings.seed * 1000 + plan.number,
            on_epoch=lambda epoch, _: on_stage(plan.title, epoch, plan.epochs),
        )
        role.files.save(
            network,
            plan.folder,
            vocabulary=vocabulary,
            steps=len(examples) * plan.epochs,
            seconds=round(processor_seconds() - self.begun, 1),
            settings={**settings.as_json(), "corpus": settings.corpus.name},
        )
        return FinishedFit(name=plan.folder.name, examples=len(examples), loss=loss)

    def _follow(self, corpus: Corpus, plans: Sequence[CorpusPlan]) -> None:
        """Writes the lessons of sessions of the corpus."""
        for plan in plans:
            self._follow_one(corpus, plan)

    def _follow_one(self, corpus: Corpus, plan: CorpusPlan) -> None:
        entry = corpus.entries[plan.number]
        session = entry.load()
        if is_held_out(session.header):
            return
        town = find_town(session.header.town, entry.maps)
        if town is None:
            raise SessionError(f"{session.name}: there is no map of {session.header.town}; it cannot be replayed")
        found: list[Example] = []
        self.role.follow(session, town, found.append)
        _write(self.role.examples, found, plan.file)


class _PracticeSessions(Generic[Network, Batch, Example, Settings]):
    """Plays sessions of practice: with acts observed for odd seeds, and hidden for even ones.

    With hidden acts, player and teacher hear through the parser, and its errors are part of the examples.
    """

    def __init__(self, role: LearnedRole[Network, Batch, Example, Settings], folder: Path, settings: Settings) -> None:
        torch.set_num_threads(1)
        self._role, self._settings = role, settings
        self._network, page = role.files.load(folder)
        self._vocabulary = page.vocabulary
        self._engines: dict[tuple[str, bool], list[SessionEngine]] = {}

    def __call__(self, plans: Sequence[PracticePlan]) -> None:
        found: list[list[Example]] = [[] for _ in plans]
        seats: Counter[tuple[str, bool]] = Counter()
        sessions = []
        for plan, own in zip(plans, found, strict=True):
            kind = plan.town, plan.seed % 2 == 1
            engine = self._engine(*kind, seats[kind])
            seats[kind] += 1
            sessions.append(PracticeSession(engine=engine, seed=plan.seed, on_example=own.append))
        self._role.practise(self._network, self._vocabulary, sessions, self._settings)
        for plan, own in zip(plans, found, strict=True):
            _write(self._role.examples, own, plan.file)

    def _engine(self, town: str, observe_acts: bool, number: int) -> SessionEngine:
        """Returns the engine of the session of a number among those of a kind that are played at the same time."""
        engines = self._engines.setdefault((town, observe_acts), [])
        while len(engines) <= number:
            config = EnvConfig(max_seconds=self._settings.max_seconds, observe_acts=observe_acts)
            engines.append(SessionEngine(town, config=config))
        return engines[number]


def _write(examples: type[Batch], found: Sequence[Any], file: Path) -> None:
    forms = forms_in(form for one in found for form in one.remarks)
    examples.of(found, forms).write(file, forms)
