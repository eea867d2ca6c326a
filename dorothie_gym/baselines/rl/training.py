"""Reinforcement learning with stable-baselines3 as a resumable run in a folder."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final

import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from dorothie_gym.archive.corpus import Fold
from dorothie_gym.baselines.learning_curves import draw_reward_curve
from dorothie_gym.baselines.rl.behaviour_cloning import CloningResult, CriticWarmUp, clone, read_demonstrations
from dorothie_gym.baselines.rl.checkpoint import LinearSchedule, Model, make_model, save_model
from dorothie_gym.baselines.rl.environments import ROLE_ENVIRONMENTS, make_training_env
from dorothie_gym.baselines.rl.evaluation import evaluate_settings, greedy_policy
from dorothie_gym.baselines.rl.resumption import restore_state, state_of
from dorothie_gym.baselines.rl.run import (
    BEST,
    CURVE,
    OnProgress,
    OnStage,
    Run,
    TrainingEvaluation,
    TrainingResult,
    ignore_stage,
)
from dorothie_gym.baselines.rl.settings import FINAL_ENTROPY, TrainingSettings
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.navigation.observation_fields import MAX_SECONDS

LOGGED_STEPS: Final = 1024
"""Approximate number of steps between TensorBoard records of on-policy algorithms."""

CHECKPOINT_SHARE: Final = 0.005
"""Largest share of the time that the writing of checkpoints takes."""

SMALL_NETWORK: Final = 256
"""Largest layer width for which torch uses one thread: more threads would wait for each other longer than they work."""

LOGGED_EPISODES: Final = 4
"""Number of episodes between TensorBoard records of off-policy algorithms."""


def best_of(rows: Sequence[TrainingEvaluation], settings: TrainingSettings) -> TrainingEvaluation | None:
    """Returns the evaluation with the highest success rate; of equal ones, the one with the highest reward.

    For an Ad-Wizard, the success of a session belongs to its opponents, so its best evaluation is the one with the
    highest reward.
    """
    adversarial = ROLE_ENVIRONMENTS.get(settings.env) is Role.AD_WIZARD
    return max(rows, key=lambda row: (0.0 if adversarial else row.outcome.success, row.outcome.reward), default=None)


class Training(Run):
    """Training of a model; `run` trains until all steps are done or Ctrl-C is pressed.

    Attributes:
        settings: settings of the training.
        model: model that learns.
        cloned: result of the warm start; None without one, or if it was done before the resumption.
    """

    def __init__(
        self,
        settings: TrainingSettings,
        folder: Path,
        on_progress: OnProgress | None = None,
        ray: str | None = None,
        on_stage: OnStage = ignore_stage,
        device: str = "cpu",
    ) -> None:
        """Prepares a training, or resumes the one in the folder.

        Args:
            settings: settings of the training.
            folder: output folder.
            on_progress: callback for the progress.
            ray: address of a Ray cluster that steps the environments; None for this machine.
            on_stage: callback for the progress of a warm start.
            device: device of the networks, as torch names it; the files do not depend on it.

        Raises:
            SettingsError: the folder holds a training with other settings, or the settings or the device are invalid.
            ProcessError: Ray is not installed, or there is no cluster at the address.
            SessionError: the corpus of the warm start cannot be read or replayed.
            ModelFileError: the run in the folder is damaged.
        """
        super().__init__(folder, on_progress, on_stage)
        self.settings = settings
        self.cloned: CloningResult | None = None
        begun = self._read_checkpoint(settings)
        folder.mkdir(parents=True, exist_ok=True)
        self._checkpoint_after = 0.0  # time of `time.perf_counter`
        self._vector = make_training_env(settings, ray)
        try:
            self.model: Model = make_model(settings, self._vector, device)
            self.model.set_logger(self._make_logger(settings.algorithm))
            if begun is not None:
                restore_state(self.model, begun)
            elif settings.warm_start is not None:
                self._warm_start(Path(settings.warm_start))
        except Exception:
            self._vector.close()
            raise

    def run(self) -> TrainingResult:
        """Trains.

        Returns:
            The result; after Ctrl-C that of the last checkpoint, from which the run can be resumed exactly.
        """
        settings, model = self.settings, self.model
        left = settings.steps - int(model.num_timesteps)
        finished = False
        threads = torch.get_num_threads()
        if max(settings.network, default=0) <= SMALL_NETWORK:
            torch.set_num_threads(1)
        try:
            if left > 0:
                callbacks: list[BaseCallback] = [_Evaluations(self)]
                if FINAL_ENTROPY in settings.parameters:
                    first, last = (float(settings.parameters[name]) for name in ("ent_coef", FINAL_ENTROPY))
                    callbacks.append(EntropySchedule(first, last))
                if settings.warm_start is not None:
                    callbacks.append(CriticWarmUp())
                # stable-baselines3 would restart the count of rollouts after a resume: `_Evaluations` logs them
                interval = None if isinstance(model, OnPolicyAlgorithm) else LOGGED_EPISODES
                model.learn(left, callback=callbacks, reset_num_timesteps=False, log_interval=interval)
                self.checkpoint()
            finished = True
        except KeyboardInterrupt:
            pass  # the steps since the last checkpoint are repeated when the run is resumed
        finally:
            self._vector.close()
            torch.set_num_threads(threads)
        return self._result(finished=finished)

    def checkpoint(self, *, sparingly: bool = False) -> None:
        """Writes a checkpoint; if `sparingly`, only if the writing takes at most `CHECKPOINT_SHARE` of the time."""
        since = time.perf_counter()
        if sparingly and since < self._checkpoint_after:
            return
        page, tensors = state_of(self.model)
        self._write_checkpoint(self.settings, int(self.model.num_timesteps), page, tensors)
        now = time.perf_counter()
        self._checkpoint_after = now + (now - since) / CHECKPOINT_SHARE

    def _warm_start(self, corpus: Path) -> None:
        """Clones the Co-Wizards of a corpus."""
        since = time.perf_counter()
        max_seconds = self.settings.env_settings.get("max_seconds", MAX_SECONDS)
        training, held_out = (
            read_demonstrations(corpus, fold, max_seconds, self._on_stage) for fold in (Fold.TRAIN, Fold.VAL)
        )
        self.cloned = clone(self.model, training, held_out, self.settings.seed, self._on_stage)
        self.seconds += time.perf_counter() - since
        self._write_cloned(asdict(self.cloned))

    def evaluate(self) -> None:
        """Plays the episodes of an evaluation, and saves the model and the result."""
        settings = self.settings
        act = greedy_policy(self.model, masked=settings.masked)
        outcome = evaluate_settings(settings, act, settings.episodes)
        row = TrainingEvaluation(steps=int(self.model.num_timesteps), seconds=round(self.seconds, 2), outcome=outcome)
        self.rows.append(row)
        for name in ("success", "reward", "length"):
            self.model.logger.record(f"eval/{name}", getattr(outcome, name))
        self.model.logger.dump(row.steps)
        save_model(self.model, settings, self.folder, self.seconds)
        if best_of(self.rows, settings) is row:
            save_model(self.model, settings, self.folder / BEST, self.seconds)
        self._write_rows()
        self._draw_curve()
        self._on_progress(row.steps, settings.steps, row)

    def add_time(self, seconds: float, steps: int) -> None:
        """Adds time of training [s], and reports the progress."""
        self.seconds += seconds
        self._on_progress(steps, self.settings.steps, None)

    def _draw_curve(self) -> None:
        draw_reward_curve([row.as_json() for row in self.rows], _title(self.settings), self.folder / CURVE)


class EntropySchedule(BaseCallback):
    """Decreases the weight of the entropy linearly over the steps of a training.

    A policy that no longer needs to explore becomes deterministic, so that its most likely actions do as well as
    sampled ones.
    """

    def __init__(self, first: float, last: float) -> None:
        super().__init__()
        self._schedule = LinearSchedule(first, last)

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        model: Model = self.model
        model.ent_coef = self._schedule(1.0 - model.num_timesteps / model._total_timesteps)


class _Evaluations(BaseCallback):
    """Evaluates between rollouts and at the end, and measures the time of training without evaluations."""

    def __init__(self, training: Training) -> None:
        super().__init__()
        self._training = training
        self._since = time.perf_counter()
        every = training.settings.evaluate_every
        self._due = (training.rows[-1].steps // every + 1) * every if training.rows else every

    def _on_training_start(self) -> None:
        training = self._training
        if training.steps == 0 and not training.rows:
            training.checkpoint()  # before any model: a folder with a model and no checkpoint is of an older version
            if training.settings.warm_start is not None:
                training.evaluate()
        self._since = time.perf_counter()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        self._add_time()
        if self.num_timesteps >= self._due:
            self._evaluate()
        self._training.checkpoint(sparingly=True)

    def _on_rollout_end(self) -> None:
        if isinstance(self.model, OnPolicyAlgorithm):  # the others count episodes
            size = self.model.n_steps * self.model.n_envs
            if (self.num_timesteps // size) % max(LOGGED_STEPS // size, 1) == 0:
                self.model.dump_logs()

    def _on_training_end(self) -> None:
        self._add_time()
        rows = self._training.rows
        if not rows or rows[-1].steps < self.num_timesteps:
            self._evaluate()

    def _add_time(self) -> None:
        now = time.perf_counter()
        self._training.add_time(now - self._since, self.num_timesteps)
        self._since = now

    def _evaluate(self) -> None:
        every = self._training.settings.evaluate_every
        self._due = (self.num_timesteps // every + 1) * every
        self._training.evaluate()
        self._since = time.perf_counter()


def _title(settings: TrainingSettings) -> str:
    arguments = ", ".join(f"{name} {value}" for name, value in settings.env_settings.items())
    return f"{settings.algorithm} on {settings.env}" + (f" ({arguments})" if arguments else "")
