"""Resumable training in a folder, with evaluations, checkpoints and a learning curve."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Generic, TypeVar

import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from dorothie_gym.baselines.learning_curves import draw_reward_curve
from dorothie_gym.baselines.rl.behaviour_cloning import (
    CloningResult,
    CriticWarmUp,
    ReportProgress,
    clone,
    read_lessons,
    silent,
)
from dorothie_gym.baselines.rl.checkpoint import DESCRIPTION, make_model, read_description, restore, save_model
from dorothie_gym.baselines.rl.environments import EnvFactory, make_vector
from dorothie_gym.baselines.rl.evaluation import SEEDS_FROM, EpisodeStatistics, act_with, evaluate_policy
from dorothie_gym.baselines.rl.settings import TrainingSettings
from dorothie_gym.errors import SettingsError
from dorothie_gym.policies.navigation.observation_vector import MAX_SECONDS
from dorothie_gym.recording import Fold

PROGRESS, CURVE, BEST, CLONED = "progress.jsonl", "curve.png", "best", "cloned.json"
"""Files of a run beside its model: a line for each evaluation, their picture, a folder with the best model, and what
came of cloning."""

LIVE = ("steps", "evaluate_every", "episodes", "workers")
"""Settings that may change when a training is resumed."""

LOGGED_STEPS, LOGGED_EPISODES = 1024, 4
"""Approximate interval of TensorBoard records [steps, episodes]."""

Evaluation = TypeVar("Evaluation")
OnProgress = Callable[[int, int, "Evaluation | None"], None]
"""Callback with the steps done, their total, and a new evaluation if there is one."""


@dataclass(frozen=True, kw_only=True)
class TrainingEvaluation:
    """Evaluation after a number of steps and a duration of training [s]."""

    steps: int
    seconds: float
    outcome: EpisodeStatistics

    def as_json(self) -> dict[str, Any]:
        """Returns the evaluation in JSON types."""
        return {"steps": self.steps, "seconds": self.seconds, **asdict(self.outcome)}


@dataclass(frozen=True, kw_only=True)
class TrainingResult(Generic[Evaluation]):
    """Result of a training.

    Attributes:
        folder: folder of the training.
        rows: evaluations, in order.
        steps: number of steps, with those before the resumption.
        seconds: duration of the training without evaluations [s].
        finished: whether all steps were done.
    """

    folder: Path
    rows: tuple[Evaluation, ...]
    steps: int
    seconds: float
    finished: bool


def best_of(rows: Sequence[TrainingEvaluation]) -> TrainingEvaluation | None:
    """Returns the evaluation with the highest success rate; of equal ones that with the highest reward."""
    return max(rows, key=lambda row: (row.outcome.success, row.outcome.reward), default=None)


class Training:
    """Training; `go` trains until all steps are done or Ctrl-C is pressed."""

    def __init__(
        self,
        settings: TrainingSettings,
        folder: Path,
        watch: OnProgress[TrainingEvaluation] | None = None,
        ray: str | None = None,
        tell: ReportProgress = silent,
    ) -> None:
        """Prepares a training, or resumes the one in the folder.

        Args:
            settings: settings of the training.
            folder: output folder.
            watch: callback for the progress.
            ray: address of a Ray cluster that steps the environments; None: this machine does.
            tell: callback for the progress of a warm start.

        Raises:
            SettingsError: the folder holds a training with other settings, or the settings are invalid.
            ProcessError: Ray is not installed, or there is no cluster at the address.
            SessionError: the corpus of the warm start cannot be read or played again.
            ModelFileError: the run in the folder is damaged.
        """
        self.settings, self.folder = settings, folder
        self._watch, self._tell = watch or (lambda done, total, row: None), tell
        self.rows: list[TrainingEvaluation] = []
        self.seconds = 0.0
        self.cloned: CloningResult | None = None
        begun = (folder / DESCRIPTION).is_file()
        if begun:
            check_same(settings, TrainingSettings(**read_description(folder)["settings"]), folder)
            self.rows = _read_rows(folder / PROGRESS)
        folder.mkdir(parents=True, exist_ok=True)
        torch.set_num_threads(1)  # small networks: more threads only wait for one another
        self._vector = make_vector(settings, ray)
        log = folder / "tensorboard" if find_spec("tensorboard") is not None else None
        try:
            self.model = make_model(settings, self._vector, log=log)
            if begun:
                restore(self.model, folder)
                self.seconds = float(read_description(folder)["seconds"])
            elif settings.warm_start is not None:
                self._learn_from(Path(settings.warm_start))
        except Exception:
            self._vector.close()
            raise

    def go(self) -> TrainingResult[TrainingEvaluation]:
        """Trains.

        Returns:
            The result; after Ctrl-C that of the steps so far, which are saved in the folder.
        """
        settings, model = self.settings, self.model
        left = settings.steps - int(model.num_timesteps)
        finished = left <= 0
        try:
            if left > 0:
                callbacks: list[BaseCallback] = [_Evaluations(self)]
                if settings.warm_start is not None:
                    callbacks.append(CriticWarmUp())
                model.learn(left, callback=callbacks, reset_num_timesteps=False, log_interval=_log_interval(model))
                finished = True
        except KeyboardInterrupt:
            finished = False
        finally:
            self._vector.close()
        save_model(model, settings, self.folder, self.seconds)
        if self.rows:
            draw_reward_curve([row.as_json() for row in self.rows], _title(settings), self.folder / CURVE)
        return TrainingResult(
            folder=self.folder, rows=tuple(self.rows), steps=int(model.num_timesteps), seconds=self.seconds,
            finished=finished,
        )  # fmt: skip

    def _learn_from(self, corpus: Path) -> None:
        """Clones the Co-Wizards of a corpus."""
        since = time.perf_counter()
        max_seconds = self.settings.env_settings.get("max_seconds", MAX_SECONDS)
        shown, held_out = (read_lessons(corpus, fold, max_seconds, self._tell) for fold in (Fold.TRAIN, Fold.VAL))
        self.cloned = clone(self.model, shown, held_out, self.settings.seed, self._tell)
        self.seconds += time.perf_counter() - since
        (self.folder / CLONED).write_text(json.dumps(asdict(self.cloned), indent=1) + "\n", encoding="utf-8")

    def evaluate(self) -> None:
        """Plays the episodes of an evaluation, and saves the model and the result."""
        settings = self.settings
        act = act_with(self.model, masked=settings.masked)
        outcome = evaluate_policy(EnvFactory(settings.env, settings.env_settings), act, settings.episodes, SEEDS_FROM)
        row = TrainingEvaluation(steps=int(self.model.num_timesteps), seconds=round(self.seconds, 2), outcome=outcome)
        self.rows.append(row)
        for name in ("success", "reward", "length"):
            self.model.logger.record(f"eval/{name}", getattr(outcome, name))
        self.model.logger.dump(row.steps)
        save_model(self.model, settings, self.folder, self.seconds)
        if best_of(self.rows) is row:
            save_model(self.model, settings, self.folder / BEST, self.seconds)
        with (self.folder / PROGRESS).open("a", encoding="utf-8") as file:
            file.write(json.dumps(row.as_json()) + "\n")
        draw_reward_curve([row.as_json() for row in self.rows], _title(settings), self.folder / CURVE)
        self._watch(row.steps, settings.steps, row)

    def note(self, seconds: float, steps: int) -> None:
        """Adds time of training [s], and reports the progress."""
        self.seconds += seconds
        self._watch(steps, self.settings.steps, None)


class _Evaluations(BaseCallback):
    """Evaluates between rollouts, and at the end; keeps the time of training."""

    def __init__(self, training: Training) -> None:
        super().__init__()
        self._training = training
        self._since = time.perf_counter()
        every = training.settings.evaluate_every
        self._due = (training.rows[-1].steps // every + 1) * every if training.rows else every

    def _on_training_start(self) -> None:
        if self._training.cloned is not None:
            self._training.evaluate()
        self._since = time.perf_counter()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        self._note()
        if self.num_timesteps >= self._due:
            self._evaluate()

    def _on_training_end(self) -> None:
        self._note()
        rows = self._training.rows
        if not rows or rows[-1].steps < self.num_timesteps:
            self._evaluate()

    def _note(self) -> None:
        now = time.perf_counter()
        self._training.note(now - self._since, self.num_timesteps)
        self._since = now

    def _evaluate(self) -> None:
        every = self._training.settings.evaluate_every
        self._due = (self.num_timesteps // every + 1) * every
        self._training.evaluate()
        self._since = time.perf_counter()


def check_same(wanted: Any, begun: Any, folder: Path) -> None:
    """Raises `SettingsError` where a run in a folder was begun with settings other than those wanted, `LIVE` aside."""
    same = replace(begun, **{name: getattr(wanted, name) for name in LIVE})
    for name, value in wanted.as_json().items():
        if same.as_json()[name] != json.loads(json.dumps(value)):
            raise SettingsError(
                f"{folder}: a run with another {name} is there ({same.as_json()[name]}, not {value}); "
                "choose another folder, or the same settings to go on"
            )


def _log_interval(model: Any) -> int:
    """Returns the interval of TensorBoard records in rollouts, or in episodes for off-policy algorithms."""
    if not isinstance(model, OnPolicyAlgorithm):
        return LOGGED_EPISODES
    return max(LOGGED_STEPS // (model.n_steps * model.n_envs), 1)


def _read_rows(path: Path) -> list[TrainingEvaluation]:
    rows = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else ():
        found = json.loads(line)
        steps, seconds = found.pop("steps"), found.pop("seconds")
        rows.append(TrainingEvaluation(steps=steps, seconds=seconds, outcome=EpisodeStatistics(**found)))
    return rows


def _title(settings: TrainingSettings) -> str:
    more = ", ".join(f"{name} {value}" for name, value in settings.env_settings.items())
    return f"{settings.algorithm} on {settings.env}" + (f" ({more})" if more else "")
