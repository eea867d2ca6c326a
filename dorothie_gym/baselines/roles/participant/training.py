"""Training of the learned participant: imitation of a corpus, then rounds of practice beside the teacher."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

import torch

from dorothie_gym.archive.corpus import Corpus
from dorothie_gym.baselines.roles.co_wizard.demonstrations import is_held_out
from dorothie_gym.baselines.roles.learned_role.batches import forms_in
from dorothie_gym.baselines.roles.learned_role.rounds import (
    CorpusPlan,
    FitPlan,
    OnStage,
    PracticePlan,
    RoundSettings,
    Stage,
    processor_seconds,
    train_in_rounds,
)
from dorothie_gym.baselines.roles.learned_role.supervised import fit
from dorothie_gym.baselines.roles.participant.demonstrations import follow, practise
from dorothie_gym.baselines.roles.participant.examples import Batch, Example, batch_of
from dorothie_gym.baselines.roles.participant.files import KIND, MODEL_FORMAT, ModelPage, load_network, save_network
from dorothie_gym.baselines.roles.participant.fitting import loss_of
from dorothie_gym.baselines.roles.participant.network import Layout, ParticipantNetwork
from dorothie_gym.baselines.roles.participant.policy import LearnedParticipant
from dorothie_gym.errors import SessionError
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine

_PRACTICE: Final = 31
"""Branch of the seed of the sessions of the practice."""


def train_participant(
    settings: RoundSettings, out: Path, *, workers: int, on_stage: OnStage, lessons: Path | None = None
) -> tuple[Stage, ...]:
    """Trains a participant; a started training is resumed. See `train_in_rounds`."""
    torch.set_num_threads(1)  # small layers: more threads only wait for each other, and change the last bits
    learner = ParticipantLearner(settings=settings)
    return train_in_rounds(learner, settings, out, workers=workers, on_stage=on_stage, lessons=lessons)


@dataclass(frozen=True, kw_only=True)
class ParticipantLearner:
    """Functions of the training, see `rounds.Learner`.

    Attributes:
        settings: settings of the training.
        begun: processor time at the beginning of the training [s].
    """

    settings: RoundSettings
    begun: float = field(default_factory=processor_seconds)

    @property
    def branch(self) -> int:
        """Branch of the seed from which the sessions of the practice are drawn; no rollout or corpus draws from it."""
        return _PRACTICE

    def follower(self) -> Callable[[CorpusPlan], None]:
        """Returns the function that follows a session; those of held-out personas are left out."""
        torch.set_num_threads(1)
        return partial(_follow, Corpus.load(self.settings.corpus).filter(fold="train"))

    def player(self, folder: Path) -> Callable[[PracticePlan], None]:
        """Returns the function that plays a session of practice."""
        return _Practice(folder, self.settings)

    def fit(self, plan: FitPlan, on_stage: OnStage) -> Stage:
        """Fits a network to lessons, and saves it."""
        settings = self.settings
        vocabulary = Batch.vocabulary_of(plan.corpus_files, settings.least)
        examples = Batch.read(plan.files, vocabulary)
        torch.manual_seed(settings.seed)
        network = ParticipantNetwork(Layout.of(len(vocabulary)))
        if plan.former is not None:
            network, _ = load_network(plan.former)
        on_stage(plan.title, 0, plan.epochs)
        loss = fit(
            network,
            examples,
            partial(loss_of, network),
            epochs=plan.epochs,
            seed=settings.seed * 1000 + plan.number,
            on_epoch=lambda epoch, _: on_stage(plan.title, epoch, plan.epochs),
        )
        page = ModelPage(
            format=MODEL_FORMAT,
            kind=KIND,
            layout=network.layout,
            vocabulary=vocabulary,
            steps=len(examples) * plan.epochs,
            seconds=round(processor_seconds() - self.begun, 1),
            settings={**settings.as_json(), "corpus": settings.corpus.name},
        )
        save_network(network, page, plan.folder)
        return Stage(name=plan.folder.name, examples=len(examples), loss=loss)


def _follow(corpus: Corpus, plan: CorpusPlan) -> None:
    """Writes the lessons of a session of the corpus."""
    entry = corpus.entries[plan.number]
    session = entry.load()
    if is_held_out(session.header):
        return
    town = find_town(session.header.town, entry.maps)
    if town is None:
        raise SessionError(f"{session.name}: there is no map of {session.header.town}; it cannot be replayed")
    found: list[Example] = []
    follow(session, town, found.append)
    _write(found, plan.file)


class _Practice:
    """Plays sessions of practice."""

    def __init__(self, folder: Path, settings: RoundSettings) -> None:
        torch.set_num_threads(1)
        self._network, page = load_network(folder)
        self._vocabulary, self._share = page.vocabulary, settings.share
        self._config = EnvConfig(max_seconds=settings.max_seconds)
        self._engines: dict[str, SessionEngine] = {}

    def __call__(self, plan: PracticePlan) -> None:
        engine = self._engines.setdefault(plan.town, SessionEngine(plan.town, config=self._config))
        player = LearnedParticipant(self._network, self._vocabulary, engine.limits)
        found: list[Example] = []
        practise(player, engine, plan.seed, found.append, self._share)
        _write(found, plan.file)


def _write(found: list[Example], file: Path) -> None:
    forms = forms_in(form for one in found for form in one.remarks)
    batch_of(found, forms).write(file, forms)
