"""Resumable self-play training in a folder, with evaluations, checkpoints and a learning curve."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from dorothie_gym.baselines.learning_curves import draw_selfplay_curve
from dorothie_gym.baselines.rl.behaviour_cloning import ReportProgress, silent
from dorothie_gym.baselines.rl.checkpoint import DESCRIPTION, read_description, restore, save_model
from dorothie_gym.baselines.rl.evaluation import SEEDS_FROM, Act, EpisodeStatistics, evaluate_policy
from dorothie_gym.baselines.rl.training import CLONED, CURVE, PROGRESS, OnProgress, TrainingResult, check_same
from dorothie_gym.baselines.selfplay.demonstrations import read_lessons
from dorothie_gym.baselines.selfplay.learner import draw
from dorothie_gym.baselines.selfplay.multi_agent_rollout import AD_WIZARD, MultiAgentRollout, SelfPlayEnvFactory
from dorothie_gym.baselines.selfplay.settings import SELFPLAY, SelfPlaySettings
from dorothie_gym.errors import ModelFileError
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.recording import Fold

OPPONENTS = ("scripted", "learned")
"""Ad-Wizards of the team's evaluations."""

STRETCH = 16
"""Rollouts between checkpoints. Sessions restart at a checkpoint, so that a resumed training is exact."""


@dataclass(frozen=True, kw_only=True)
class SelfPlayEvaluation:
    """Evaluation of self-play after some training.

    Attributes:
        steps: done.
        seconds: of training, evaluations left out [s].
        scripted: what the team came to against the scripted Ad-Wizard.
        learned: the same against the one that was learning, too.
        returns: mean sum of rewards of each role in the sessions of training without scripted roles that ended since
            the row before; None where none did.
    """

    steps: int
    seconds: float
    scripted: EpisodeStatistics
    learned: EpisodeStatistics
    returns: Mapping[str, float | None]

    def as_json(self) -> dict[str, Any]:
        """Returns the evaluation in JSON types."""
        return asdict(self)

    @classmethod
    def from_json(cls, found: Mapping[str, Any]) -> SelfPlayEvaluation:
        """Reads the output of `as_json`."""
        outcomes = {name: EpisodeStatistics(**found[name]) for name in OPPONENTS}
        return cls(steps=found["steps"], seconds=found["seconds"], returns=found["returns"], **outcomes)


class SelfPlayTraining:
    """Training; `go` trains until all steps are done or Ctrl-C is pressed.

    Attributes:
        settings: what is trained.
        folder: gets a folder with a model for each role, `progress.jsonl` and `curve.png`.
        game: sessions and learners.
        rows: evaluations so far.
    """

    def __init__(
        self,
        settings: SelfPlaySettings,
        folder: Path,
        watch: OnProgress[SelfPlayEvaluation] | None = None,
        ray: str | None = None,
        tell: ReportProgress = silent,
    ) -> None:
        """Prepares a training, or resumes the one in the folder.

        Args:
            settings: what is trained.
            folder: where all is written.
            watch: callback for the progress.
            ray: address of a Ray cluster that steps the environments; None: this machine does.
            tell: callback for the progress of a warm start.

        Raises:
            SettingsError: the folder has a run with other settings, or nothing can be trained with these.
            ProcessError: Ray is not installed, or there is no cluster at the address.
            SessionError: the corpus of the warm start cannot be read or played again.
            ModelFileError: the run in the folder is damaged.
        """
        self.settings, self.folder = settings, folder
        self._watch, self._tell = watch or (lambda done, total, row: None), tell
        self.rows: list[SelfPlayEvaluation] = []
        self.seconds, self.steps = 0.0, 0
        self._tally = _tally([])  # of the sessions of training since the last row
        begun = (folder / AGENT_ROLES[AD_WIZARD] / DESCRIPTION).is_file()
        if begun:
            found = read_description(folder / AGENT_ROLES[AD_WIZARD])
            check_same(settings, SelfPlaySettings(**found["settings"]), folder)
        folder.mkdir(parents=True, exist_ok=True)
        torch.set_num_threads(1)  # small networks: more threads only wait for one another
        log = folder / "tensorboard" if find_spec("tensorboard") is not None else None
        self.game = MultiAgentRollout(settings, log, ray)
        try:
            if begun:
                self._take_up()
            elif settings.warm_start is not None:
                self._learn_from(Path(settings.warm_start))
        except Exception:
            self.game.close()
            raise

    def go(self) -> TrainingResult[SelfPlayEvaluation]:
        """Trains.

        Returns:
            The result; after Ctrl-C that of the last checkpoint.
        """
        finished = False
        try:
            while self.steps < self.settings.steps:
                self._go_on()
            finished = True
        except KeyboardInterrupt:
            pass  # what was done since the last stretch ended will be done again
        finally:
            self.game.close()
        return TrainingResult(
            folder=self.folder, rows=tuple(self.rows), steps=self.steps, seconds=self.seconds, finished=finished
        )

    def _learn_from(self, corpus: Path) -> None:
        """Begins with what the roles of a corpus did; the first row of the progress is what that is worth."""
        since = time.perf_counter()
        shown, held_out = (read_lessons(corpus, fold, self._tell) for fold in (Fold.TRAIN, Fold.VAL))
        cloned = {
            learner.name: asdict(learner.clone(shown, held_out, self.settings.seed, self._tell))
            for learner in self.game.learners
        }
        (self.folder / CLONED).write_text(json.dumps(cloned, indent=1) + "\n", encoding="utf-8")
        self.seconds = time.perf_counter() - since
        self._keep(0, self.seconds, self._tally, self._evaluate(0, self.seconds, self._tally))

    def _go_on(self) -> None:
        """Trains for a stretch; evaluates where it is time."""
        settings, game, steps = self.settings, self.game, self.steps
        due = min((steps // settings.evaluate_every + 1) * settings.evaluate_every, settings.steps)
        begun = time.perf_counter()
        game.begin(steps)
        for _ in range(STRETCH):
            steps = game.play(steps)
            self._watch(steps, settings.steps, None)
            if steps >= due:
                break
        seconds = self.seconds + time.perf_counter() - begun
        tally = self._tally + _tally(game.returns)
        row = self._evaluate(steps, seconds, tally) if steps >= due else None
        # from here on nothing takes time: Ctrl-C finds all of the stretch done, or none
        game.past.keep(game.actor(AD_WIZARD).model)
        self._keep(steps, seconds, tally, row)

    def _keep(self, steps: int, seconds: float, tally: NDArray[np.float64], row: SelfPlayEvaluation | None) -> None:
        """Writes everything as it is after so many steps."""
        self.steps, self.seconds, self._tally = steps, seconds, tally
        if row is not None:
            self.rows.append(row)
            self._tally = _tally([])
        self._save()
        if row is not None:
            draw_selfplay_curve([row.as_json() for row in self.rows], _title(self.settings), self.folder / CURVE)
            self._watch(steps, self.settings.steps, row)

    def _evaluate(self, steps: int, seconds: float, tally: NDArray[np.float64]) -> SelfPlayEvaluation:
        """Plays the evaluation's sessions."""
        outcomes = {name: self._outcome(name) for name in OPPONENTS}
        row = SelfPlayEvaluation(
            steps=steps, seconds=round(seconds, 2), returns=_means(tally),
            scripted=outcomes["scripted"], learned=outcomes["learned"],
        )  # fmt: skip
        self._log(row)
        return row

    def _outcome(self, ad_wizard: str) -> EpisodeStatistics:
        maker = SelfPlayEnvFactory(self.settings.env_settings, (Role.AD_WIZARD,) if ad_wizard == "scripted" else ())
        return evaluate_policy(maker, self.act_with(SEEDS_FROM), self.settings.episodes, SEEDS_FROM)

    def act_with(self, seed: int) -> Act:
        """Returns the present policy of all roles on rows of the layout; it samples with a seed."""
        game, rng = self.game, np.random.default_rng(seed)

        def act(rows: NDArray[Any], masks: NDArray[np.bool_] | None) -> Sequence[Any]:
            chosen = []
            for role in range(len(AGENT_ROLES)):
                learner = game.actor(role)
                vectors = game.table.vectors(rows, role, padded=learner.padded)
                chosen.append(draw(learner.model, vectors, game.table.masks(rows, role, padded=learner.padded), rng))
            return list(np.stack(chosen, axis=1))

        return act

    def _log(self, row: SelfPlayEvaluation) -> None:
        logger = self.game.learners[0].model.logger
        for name, outcome in (("scripted", row.scripted), ("learned", row.learned)):
            logger.record(f"eval/success_against_{name}", outcome.success)
            logger.record(f"eval/reward_against_{name}", outcome.reward)
            logger.record(f"eval/length_against_{name}", outcome.length)
        logger.dump(row.steps)

    def _save(self) -> None:
        settings, table = self.settings, self.game.table
        for k, role in enumerate(AGENT_ROLES):
            learner = self.game.actor(k)
            about = {
                "kind": SELFPLAY, "role": str(role), "size": table.sizes[k], "actions": table.actions[k],
                "padded": [learner.size, learner.actions] if learner.padded else None, "tally": self._tally.tolist(),
            }  # fmt: skip
            save_model(learner.model, settings, self.folder / role, self.seconds, about)
        self.game.past.save(self.folder)
        lines = "".join(json.dumps(row.as_json()) + "\n" for row in self.rows)
        (self.folder / PROGRESS).write_text(lines, encoding="utf-8")

    def _take_up(self) -> None:
        """Goes back to what is in the folder."""
        found = {role: read_description(self.folder / role) for role in AGENT_ROLES}
        steps = {int(description["steps"]) for description in found.values()}
        if len(steps) > 1:
            raise ModelFileError(
                f"{self.folder}: the models are of different steps ({sorted(steps)}); start a new training"
            )
        for learner in self.game.learners:
            restore(learner.model, self.folder / AGENT_ROLES[learner.roles[0]])
        self.game.past.load(self.folder)
        lines = (self.folder / PROGRESS).read_text(encoding="utf-8").splitlines()
        self.steps = steps.pop()
        self.rows = [
            row for row in map(SelfPlayEvaluation.from_json, map(json.loads, lines)) if row.steps <= self.steps
        ]
        about = found[AGENT_ROLES[AD_WIZARD]]
        self.seconds, self._tally = float(about["seconds"]), np.array(about["tally"], dtype=np.float64)


def _tally(returns: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Returns the number of sessions and the sums of their rewards by role (4,)."""
    sums: NDArray[np.float64] = np.sum(np.reshape(returns, (-1, len(AGENT_ROLES))), axis=0)
    return np.concatenate(([float(len(returns))], sums))


def _means(tally: NDArray[np.float64]) -> dict[str, float | None]:
    sessions, *sums = tally.tolist()
    return {
        str(role): round(total / sessions, 4) if sessions else None
        for role, total in zip(AGENT_ROLES, sums, strict=True)
    }


def _title(settings: SelfPlaySettings) -> str:
    return f"self-play in {settings.town}, {'one network' if settings.shared else 'a network for each role'}"
