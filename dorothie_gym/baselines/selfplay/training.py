"""Self-play as a resumable run in a folder."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.learning_curves import draw_selfplay_curve
from dorothie_gym.baselines.rl.checkpoint import (
    check_parameters,
    parameters_of,
    refusing_misfits,
    save_model,
    set_parameters,
    tensors_under,
)
from dorothie_gym.baselines.rl.evaluation import FIRST_SEED, Act, EpisodeStatistics, evaluate_policy
from dorothie_gym.baselines.rl.resumption import Checkpoint
from dorothie_gym.baselines.rl.run import (
    CURVE,
    OnProgress,
    OnStage,
    Run,
    RunEvaluation,
    TrainingResult,
    ignore_stage,
)
from dorothie_gym.baselines.rl.settings import SELFPLAY, Page, SelfPlaySettings
from dorothie_gym.baselines.selfplay.demonstrations import read_demonstrations
from dorothie_gym.baselines.selfplay.learner import sample_actions
from dorothie_gym.baselines.selfplay.multi_agent_rollout import AD_WIZARD, MultiAgentRollout
from dorothie_gym.baselines.selfplay.vec_env import SelfPlayEnvFactory
from dorothie_gym.baselines.tensor_files import refuse_unknown
from dorothie_gym.errors import ModelFileError
from dorothie_gym.input_files import checked, raising
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.navigation.observation_vector import Vector
from dorothie_gym.recording.corpus import Fold

OPPONENTS: Final = ("scripted", "learned")
"""Ad-Wizards of the team's evaluations."""

ROLLOUTS_PER_CHECKPOINT: Final = 16
"""Rollouts between checkpoints. Sessions restart at a checkpoint, so that a resumed training is exact."""


@dataclass(frozen=True, kw_only=True)
class SelfPlayEvaluation(RunEvaluation):
    """Evaluation of self-play.

    Attributes:
        scripted: statistics of the team against the scripted Ad-Wizard.
        learned: statistics of the team against the learned Ad-Wizard.
        returns: mean sum of rewards of each role in the training sessions without coaching that ended since the
            previous evaluation; None if there were none.
    """

    scripted: EpisodeStatistics
    learned: EpisodeStatistics
    returns: Mapping[str, float | None]

    def as_json(self) -> Page:
        """Returns the evaluation in JSON types."""
        return asdict(self)

    @classmethod
    def from_json(cls, page: Page) -> SelfPlayEvaluation:
        """Reads the output of `as_json`."""
        return checked(page, cls, "evaluation")


class SelfPlayTraining(Run[SelfPlayEvaluation]):
    """Training of all three roles; `run` trains until all steps are done or Ctrl-C is pressed.

    The folder of the run holds a folder with the model of each role that learns.

    Attributes:
        settings: settings of the training.
        rollout: sessions and learners.
    """

    def __init__(
        self,
        settings: SelfPlaySettings,
        folder: Path,
        on_progress: OnProgress[SelfPlayEvaluation] | None = None,
        ray: str | None = None,
        on_stage: OnStage = ignore_stage,
    ) -> None:
        """Prepares a training, or resumes the one in the folder.

        Args:
            settings: settings of the training.
            folder: output folder.
            on_progress: callback for the progress.
            ray: address of a Ray cluster that steps the environments; None for this machine.
            on_stage: callback for the progress of a warm start.

        Raises:
            SettingsError: the folder holds a run with other settings, or the settings are invalid.
            ProcessError: Ray is not installed, or there is no cluster at the address.
            SessionError: the corpus of the warm start cannot be read or replayed.
            ModelFileError: the run in the folder is damaged.
        """
        super().__init__(folder, on_progress, on_stage)
        self.settings = settings
        self._totals = _totals([])  # of the training sessions since the last evaluation
        begun = self._read_checkpoint(settings, SelfPlayEvaluation, folder / AGENT_ROLES[AD_WIZARD])
        folder.mkdir(parents=True, exist_ok=True)
        self.rollout = MultiAgentRollout(settings, self._make_logger, ray)
        try:
            if begun is None:
                self._save_state(0)  # before any model: a folder with a model and no checkpoint is of an older version
            else:
                self._resume(begun)
            if settings.warm_start is not None and not self.rows:
                self._warm_start(Path(settings.warm_start))
        except Exception:
            self.rollout.close()
            raise

    def run(self) -> TrainingResult[SelfPlayEvaluation]:
        """Trains.

        Returns:
            The result; after Ctrl-C that of the last checkpoint.
        """
        finished = False
        try:
            while self.steps < self.settings.steps:
                self._train_to_checkpoint()
            finished = True
        except KeyboardInterrupt:
            pass  # the rollouts since the last checkpoint are repeated when the run is resumed
        finally:
            self.rollout.close()
        return self._result(finished=finished)

    def _warm_start(self, corpus: Path) -> None:
        """Clones the roles of a corpus; the first evaluation of the run is that of the clones."""
        since = time.perf_counter()
        training, held_out = (read_demonstrations(corpus, fold, self._on_stage) for fold in (Fold.TRAIN, Fold.VAL))
        cloned = {
            learner.name: asdict(learner.clone(training, held_out, self.settings.seed, self._on_stage))
            for learner in self.rollout.learners
        }
        self._write_cloned(cloned)
        self.seconds = time.perf_counter() - since
        self._checkpoint(0, self.seconds, self._totals, self._evaluate(0, self.seconds, self._totals))

    def _train_to_checkpoint(self) -> None:
        """Trains until the next checkpoint, and evaluates if an evaluation is due."""
        settings, rollout, steps = self.settings, self.rollout, self.steps
        due = min((steps // settings.evaluate_every + 1) * settings.evaluate_every, settings.steps)
        since = time.perf_counter()
        rollout.reset(steps)
        for _ in range(ROLLOUTS_PER_CHECKPOINT):
            steps = rollout.play(steps)
            self._on_progress(steps, settings.steps, None)
            if steps >= due:
                break
        seconds = self.seconds + time.perf_counter() - since
        totals = self._totals + _totals(rollout.returns)
        row = self._evaluate(steps, seconds, totals) if steps >= due else None
        # From here on nothing takes long: after Ctrl-C, the checkpoint exists whole or not at all.
        rollout.opponents.add(rollout.learner_of(AD_WIZARD).model)
        self._checkpoint(steps, seconds, totals, row)

    def _checkpoint(
        self, steps: int, seconds: float, totals: NDArray[np.float64], row: SelfPlayEvaluation | None
    ) -> None:
        """Writes the state after a number of steps into the folder."""
        self.seconds, self._totals = seconds, totals
        if row is not None:
            self.rows.append(row)
            self._totals = _totals([])
        self._save(steps)
        if row is not None:
            draw_selfplay_curve([row.as_json() for row in self.rows], _title(self.settings), self.folder / CURVE)
            self._on_progress(steps, self.settings.steps, row)

    def _evaluate(self, steps: int, seconds: float, totals: NDArray[np.float64]) -> SelfPlayEvaluation:
        """Plays the sessions of an evaluation."""
        outcomes = {name: self._outcome(name) for name in OPPONENTS}
        row = SelfPlayEvaluation(steps=steps, seconds=round(seconds, 2), returns=_means(totals), **outcomes)
        self._log(row)
        return row

    def _outcome(self, ad_wizard: str) -> EpisodeStatistics:
        scripted = (Role.AD_WIZARD,) if ad_wizard == "scripted" else ()
        make = SelfPlayEnvFactory(self.settings.env_settings, scripted)
        return evaluate_policy(make, self.sampling_policy(FIRST_SEED), self.settings.episodes)

    def sampling_policy(self, seed: int) -> Act:
        """Returns the present policy of the roles that learn, on rows of the layout; it samples with a seed."""
        rollout, rng = self.rollout, np.random.default_rng(seed)
        layout, learning = rollout.layout, self._learning

        def act(rows: Vector, masks: NDArray[np.bool_] | None) -> Sequence[NDArray[np.int64]]:
            chosen = np.zeros((len(rows), len(AGENT_ROLES)), dtype=np.int64)
            for role in learning:
                learner = rollout.learner_of(role)
                vectors = layout.vectors(rows, role, padded=learner.padded)
                role_masks = layout.masks(rows, role, padded=learner.padded)
                chosen[:, role] = sample_actions(learner.model, vectors, role_masks, rng)
            return list(chosen)

        return act

    @property
    def _learning(self) -> list[int]:
        """Roles that learn, by their index in `AGENT_ROLES`."""
        return [k for k, role in enumerate(AGENT_ROLES) if role not in self.settings.partners]

    def _log(self, row: SelfPlayEvaluation) -> None:
        logger = self.rollout.learners[0].model.logger
        for name, outcome in (("scripted", row.scripted), ("learned", row.learned)):
            logger.record(f"eval/success_against_{name}", outcome.success)
            logger.record(f"eval/reward_against_{name}", outcome.reward)
            logger.record(f"eval/length_against_{name}", outcome.length)
        logger.dump(row.steps)

    def _save(self, steps: int) -> None:
        layout = self.rollout.layout
        for k in self._learning:
            role, learner = AGENT_ROLES[k], self.rollout.learner_of(k)
            fields = {
                "kind": SELFPLAY, "role": str(role), "size": layout.sizes[k], "actions": layout.actions[k],
                "padded": [learner.size, learner.actions] if learner.padded else None,
            }  # fmt: skip
            save_model(learner.model, self.settings, self.folder / role, self.seconds, fields)
        self._write_rows()
        self._save_state(steps)

    def _save_state(self, steps: int) -> None:
        """Writes the checkpoint. Random generators are not part of it: `MultiAgentRollout.reset` seeds them."""
        parameters: dict[str, Page] = {}
        tensors = {f"past/{name}": value for name, value in self.rollout.opponents.tensors().items()}
        for learner in self.rollout.learners:
            parameters[learner.name], own = parameters_of(learner.model)
            tensors |= {f"{learner.name}/{name}": value for name, value in own.items()}
        page: Page = {"parameters": parameters, "totals": self._totals.tolist()}
        self._write_checkpoint(self.settings, steps, page, tensors)

    def _resume(self, checkpoint: Checkpoint) -> None:
        """Restores the state of the last checkpoint."""
        page, tensors = checkpoint.page, checkpoint.tensors
        with raising(ModelFileError):
            known = {"past", *(learner.name for learner in self.rollout.learners)}
            refuse_unknown(checkpoint.path, (name for name in tensors if name.split("/", 1)[0] not in known))
            for learner in self.rollout.learners:
                own = tensors_under(f"{learner.name}/", tensors)
                check_parameters(checkpoint.path, learner.model, own, f"{learner.name}/")
        with refusing_misfits(checkpoint.path):
            for learner in self.rollout.learners:
                own = tensors_under(f"{learner.name}/", tensors)
                set_parameters(learner.model, page["parameters"][learner.name], own)
            self.rollout.opponents.restore(tensors_under("past/", tensors))
            self._totals = np.array(page["totals"], dtype=np.float64)


def _totals(returns: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Returns the number of sessions and the sums of their rewards by role (4,)."""
    sums: NDArray[np.float64] = np.sum(np.reshape(returns, (-1, len(AGENT_ROLES))), axis=0)
    return np.concatenate(([float(len(returns))], sums))


def _means(totals: NDArray[np.float64]) -> dict[str, float | None]:
    sessions, *sums = totals.tolist()
    return {
        str(role): round(total / sessions, 4) if sessions else None
        for role, total in zip(AGENT_ROLES, sums, strict=True)
    }


def _title(settings: SelfPlaySettings) -> str:
    if settings.partners:
        return f"self-play in {settings.town}, with {' and '.join(settings.partners.values())}"
    return f"self-play in {settings.town}, {'one network' if settings.shared else 'a network for each role'}"
