"""Reinforcement of the learned Co-Wizard in whole sessions, which it plays with scripted or learned other roles.

Each iteration plays sessions with the present network and improves it by them (see `policy_gradient`). The sessions of
an iteration are files, and each iteration a model, so that an interrupted training goes on where it was; all follow
from the seed. The compiled batches of the navigation environments do not talk; so the sessions are those of rollouts.
"""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

import torch

from dorothie_gym.baselines.co_wizard.experience import Experience, play
from dorothie_gym.baselines.co_wizard.files import ModelPage, load_network, save_network
from dorothie_gym.baselines.co_wizard.policy import LearnedCoWizard
from dorothie_gym.baselines.co_wizard.policy_gradient import Optimisation, Progress, ValueNetwork, improve
from dorothie_gym.baselines.imitation.rounds import (
    OnStage,
    PracticePlan,
    gather,
    practice_plans,
    processor_seconds,
)
from dorothie_gym.baselines.tensor_files import check_tensors, read_tensors, save_tensors
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.errors import CheckpointError
from dorothie_gym.files import replacing, write_atomically
from dorothie_gym.input_files import MAX_SMALL_JSON, checked, raising, read_json
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.policy_loader import DESCRIPTION, find_player
from dorothie_gym.rollout.folder import locked_folder
from dorothie_gym.spaces.limits import SpaceLimits

SETTINGS_FILE: Final = "reinforcement.json"
PROGRESS_FILE: Final = "progress.json"
"""Figures of the iterations in the folder of a training."""

_VALUES: Final = "values.safetensors"
_SESSIONS: Final = 37
"""Branch of the seed from which the sessions are drawn; no rollout, corpus or practice draws from it."""


@dataclass(frozen=True, kw_only=True)
class ReinforcementSettings:
    """Settings of a training.

    Attributes:
        start: folder of the model to begin with.
        seed: seed of the sessions and of the optimisation.
        iterations: number of iterations.
        sessions: sessions of an iteration.
        max_seconds: time limit of a session [s].
        ad_wizard: name or path of the Ad-Wizard of every other session; it is scripted in the others.
        optimisation: settings of the optimisation.
    """

    start: Path
    seed: int = 0
    iterations: int = 10
    sessions: int = 40
    max_seconds: float = 600.0
    ad_wizard: str = "scripted"
    optimisation: Optimisation = field(default_factory=Optimisation)

    def __post_init__(self) -> None:
        """Checks the fields."""
        for name, low in (("seed", 0), ("iterations", 1), ("sessions", 1)):
            if getattr(self, name) < low:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be at least {low}")

    def as_json(self) -> dict[str, object]:
        """Returns the settings in JSON types."""
        return {**asdict(self), "start": str(self.start)}


def reinforce_co_wizard(
    settings: ReinforcementSettings, out: Path, *, workers: int, on_stage: OnStage
) -> tuple[Progress, ...]:  # fmt: skip
    """Trains a Co-Wizard further by reinforcement; a started training is resumed.

    Args:
        settings: settings.
        out: folder; it receives `model.json` and `model.safetensors`, and the model of each iteration.
        workers: number of processes that play sessions; the result does not depend on it.
        on_stage: callback for the progress.

    Returns:
        The figures of all iterations; those of an iteration describe its sessions, played by the model before.

    Raises:
        ModelFileError: the model to begin with cannot be read.
        ValueError: there is no such Ad-Wizard, or the policy plays another role.
        SessionError: the folder holds something else.
        CheckpointError: the figures of an iteration cannot be read.
        ProcessError: a session failed in another process.
    """
    torch.set_num_threads(1)  # small layers: more threads only wait for each other, and change the last bits
    check_ad_wizard(settings.ad_wizard)
    load_network(settings.start)
    found: list[Progress] = []
    with locked_folder(out, SETTINGS_FILE, settings.as_json()):
        former = settings.start
        for number in range(settings.iterations):
            folder = out / f"iteration-{number + 1}"
            if not (folder / PROGRESS_FILE).is_file():
                _iterate(settings, number, former, folder, workers, on_stage)
            found.append(_read_progress(folder / PROGRESS_FILE))
            former = folder
        if not (out / DESCRIPTION).is_file():
            save_network(*load_network(former), out)
        write_atomically(out / PROGRESS_FILE, json.dumps([asdict(each) for each in found], indent=1) + "\n")
    return tuple(found)


def check_ad_wizard(name: str) -> None:
    """Raises `ValueError` if a policy, by name or path, does not play the Ad-Wizard."""
    find_player(name, Role.AD_WIZARD).make(Role.AD_WIZARD, SpaceLimits())


def _read_progress(path: Path) -> Progress:
    """Returns the figures of an iteration; raises `CheckpointError` if their file is damaged."""
    with raising(lambda message: CheckpointError(f"{message}; delete it")):
        return checked(read_json(path, MAX_SMALL_JSON), Progress, path)


def _iterate(
    settings: ReinforcementSettings, number: int, former: Path, folder: Path, workers: int, on_stage: OnStage
) -> None:  # fmt: skip
    """Plays the sessions of an iteration and improves the network by them."""
    begun = processor_seconds()
    place = folder / "experience"
    plans = practice_plans([settings.seed, number], settings.sessions, _SESSIONS, place)
    title = f"Sessions, iteration {number + 1} of {settings.iterations}"
    gather(partial(_Playing, former, settings), plans, workers, partial(on_stage, title))
    network, page = load_network(former)
    before, _ = load_network(settings.start)
    torch.manual_seed(settings.seed)
    values = ValueNetwork(network.layout.state)
    if (former / _VALUES).is_file():
        with raising(lambda message: CheckpointError(f"{message}; delete it")):
            tensors, _ = read_tensors(former / _VALUES)
            check_tensors(former / _VALUES, tensors, values.state_dict())
        values.load_state_dict(tensors)
    experience = Experience.read([plan.file for plan in plans], page.vocabulary)
    seed = settings.seed * 1000 + number
    progress = improve(network, values, before, experience, settings.optimisation, seed)
    seconds = page.seconds + processor_seconds() - begun
    about = ModelPage(
        format=page.format, kind=page.kind, layout=page.layout, vocabulary=page.vocabulary,
        steps=page.steps + progress.decisions, seconds=round(seconds, 1),
        settings={**page.settings, "reinforcement": {**settings.as_json(), "start": settings.start.name}},
    )  # fmt: skip
    with replacing(folder / _VALUES) as part:
        save_tensors(values.state_dict(), part)
    save_network(network, about, folder, torch.float32)
    write_atomically(folder / PROGRESS_FILE, json.dumps(asdict(progress), indent=1) + "\n")
    shutil.rmtree(place)


class _Playing:
    """Plays sessions in a process."""

    def __init__(self, folder: Path, settings: ReinforcementSettings) -> None:
        torch.set_num_threads(1)
        self._network, page = load_network(folder)
        self._vocabulary, self._settings = page.vocabulary, settings
        self._config = EnvConfig(max_seconds=settings.max_seconds)
        self._engines: dict[str, SessionEngine] = {}

    def __call__(self, plan: PracticePlan) -> None:
        engine = self._engines.setdefault(plan.town, SessionEngine(plan.town, config=self._config))
        temperature = self._settings.optimisation.command_temperature
        player = LearnedCoWizard(self._network, self._vocabulary, engine.limits, command_temperature=temperature)
        name = self._settings.ad_wizard if plan.number % 2 else "scripted"
        ad_wizard = find_player(name, Role.AD_WIZARD).make(Role.AD_WIZARD, engine.limits)
        play(player, engine, plan.seed, ad_wizard).write(plan.file, ())
