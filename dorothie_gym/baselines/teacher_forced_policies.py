"""PPO and behaviour cloning (stable-baselines3) on the teacher-forced environments themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import gymnasium as gym
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3 import PPO
from torch import nn

from dorothie_gym.archive.corpus import Corpus
from dorothie_gym.archive.visibility import Task
from dorothie_gym.baselines import checkpoints
from dorothie_gym.baselines.gradients import backpropagate
from dorothie_gym.baselines.point_tensors import TEST, TRAIN, VALIDATION, allowed_angle
from dorothie_gym.envs.nfd_v0 import NfDEnv
from dorothie_gym.envs.rfn_v0 import RfNEnv
from dorothie_gym.envs.ufn_v0 import UfNEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.teacher_forced.predictions import ActionPredictions, ActPredictions, TaskPredictions
from dorothie_gym.wrappers.flatten import FlattenAction, FlattenObservation

if TYPE_CHECKING:
    from dorothie_gym.envs.teacher_forced import TeacherForcedEnv

ENVS: Final[dict[Task, type[TeacherForcedEnv]]] = {Task.UFN: UfNEnv, Task.RFN: RfNEnv, Task.NFD: NfDEnv}

LAYER_WIDTH: Final = 64
"""Width of each of the two layers of a policy: stable-baselines3's default."""

PASSES: Final = 3
"""Passes of PPO over the points."""

_ROLLOUT_STEPS: Final = 512
_MIN_EPOCHS, _PATIENCE, _MAX_EPOCHS = 10, 5, 40
_BATCH_SIZE: Final = 64
_LEARNING_RATE: Final = 1e-3


class FlatTask(gym.ObservationWrapper[NDArray[np.float32], Any, Any]):
    """A task with flat spaces, its numbers squeezed so that metres, seconds and ids are all about 1; texts are dropped.

    Args:
        env: the task's environment.
    """

    def __init__(self, env: TeacherForcedEnv):
        self.flat = FlattenAction(env)
        super().__init__(FlattenObservation(self.flat))
        inner: Any = self.env.observation_space
        shape = inner["observation"].shape
        self.observation_space = spaces.Box(-20.0, 20.0, shape, dtype=np.float32)

    def observation(self, observation: Any) -> NDArray[np.float32]:
        """Returns the sign of each number times the logarithm of 1 and its size."""
        values: NDArray[np.float32] = observation["observation"]
        return np.sign(values) * np.log1p(np.abs(values))

    def label(self, label: dict[str, Any]) -> NDArray[np.int64]:
        """Returns a label as a flat action."""
        task_space: Any = self.unwrapped.action_space
        parts = [np.ravel(label[name]) - getattr(task_space[name], "start", 0) for name in self.flat.sizes]
        return np.concatenate(parts).astype(np.int64)


@dataclass(frozen=True, eq=False)
class TaskDemonstrations:
    """Points of a fold as an environment shows them: observations (n, D), labels (n, A), sessions, events (n,)."""

    observations: torch.Tensor
    labels: torch.Tensor
    sessions: NDArray[np.str_]
    events: NDArray[np.int64]


def make_task(corpus: Path, task: Task, split: str, *, strict: bool = False) -> FlatTask:
    """Returns the environment of a task over a fold of a corpus; raises `SessionError` if the fold has no point."""
    return FlatTask(ENVS[task](corpus, split=split, strict=strict))


def demonstrate(env: FlatTask, sessions: int) -> TaskDemonstrations:
    """Returns the observations and labels of all points in the sessions of an environment."""
    seen, done, names, events = [], [], [], []
    wanted = np.zeros(env.flat.action_space.shape or (), dtype=np.int64)
    for number in range(sessions):
        try:
            observation, info = env.reset(options={"session": number})
        except SessionError:
            continue  # it has no point of the task
        over = False
        while not over:
            name = info["session"]
            following, _, over, _, info = env.step(wanted)
            seen.append(observation)
            done.append(env.label(info["label"]))
            names.append(name)
            events.append(info["index"])
            observation = following
    if not seen:
        raise SessionError("the fold has no point of the task")
    observations, labels = torch.from_numpy(np.stack(seen)), torch.from_numpy(np.stack(done))
    return TaskDemonstrations(observations, labels, np.array(names), np.array(events, dtype=np.int64))


def run_policy(
    corpus: Path, kind: str, seed: int, folder: Path, name: str, *, strict: bool = False
) -> tuple[tuple[TaskPredictions, ...], dict[str, Any]]:
    """Trains a policy for each task, and returns their predictions for the test sessions, and facts about the training.

    Args:
        corpus: folder of the corpus.
        kind: "ppo" or "cloning".
        seed: seed of weights and order.
        folder: folder to which the policies are written.
        name: name of the row.
        strict: whether RfN points hide the earlier acts of the Co-Wizard's own utterance.

    Raises:
        SessionError: the corpus cannot be read, or lacks a fold.
    """
    counts = {fold: len(Corpus.load(corpus).filter(fold=fold)) for fold in (TRAIN, VALIDATION, TEST)}
    found, facts = [], {}
    for task in ENVS:
        env = make_task(corpus, task, TRAIN, strict=strict)
        test = demonstrate(make_task(corpus, task, TEST, strict=strict), counts[TEST])
        learner = PPO(
            "MlpPolicy", env, seed=seed, gamma=0.0, gae_lambda=0.0, n_steps=_ROLLOUT_STEPS,
            batch_size=_BATCH_SIZE, n_epochs=4, ent_coef=0.01, device="cpu",
            policy_kwargs={"net_arch": [LAYER_WIDTH, LAYER_WIDTH]},
        )  # fmt: skip  # a prediction does not change later points: only its own reward counts
        shown = demonstrate(env, counts[TRAIN])
        if kind == "ppo":
            learner.learn(PASSES * len(shown.labels))
            facts[task.value] = {"steps": int(learner.num_timesteps)}
        else:
            validation = demonstrate(make_task(corpus, task, VALIDATION, strict=strict), counts[VALIDATION])
            facts[task.value] = {"epochs": _clone(learner.policy, shown, validation, seed)}
        checkpoints.save(folder / f"{task.value}.safetensors", learner.policy, {"model": name, "seed": seed})
        found.append(_predictions(learner.policy, env, test, task, seed, name))
    return tuple(found), facts


def _clone(policy: Any, shown: TaskDemonstrations, validation: TaskDemonstrations, seed: int) -> int:
    """Maximises the likelihood of the labels; keeps the best epoch on the validation fold. Returns the epochs."""
    optimiser = torch.optim.AdamW(policy.parameters(), lr=_LEARNING_RATE, weight_decay=1e-2)
    generator = torch.Generator().manual_seed(seed)
    lowest, best, weights = float("inf"), 0, {}
    epoch = 0
    while epoch < _MAX_EPOCHS and (epoch < _MIN_EPOCHS or epoch - best < _PATIENCE):
        epoch += 1
        for rows in torch.split(torch.randperm(len(shown.labels), generator=generator), _BATCH_SIZE):
            optimiser.zero_grad()
            loss = _surprise(policy, shown, rows)
            backpropagate(loss)
            nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
            optimiser.step()
        with torch.no_grad():
            found = float(_surprise(policy, validation, torch.arange(len(validation.labels))))
        if found < lowest:
            lowest, best = found, epoch
            weights = {key: value.clone() for key, value in policy.state_dict().items()}
    policy.load_state_dict(weights)
    return epoch


def _surprise(policy: Any, shown: TaskDemonstrations, rows: torch.Tensor) -> torch.Tensor:
    _, likely, _ = policy.evaluate_actions(shown.observations[rows], shown.labels[rows])
    loss: torch.Tensor = -likely.mean()
    return loss


def _predictions(
    policy: Any, env: FlatTask, test: TaskDemonstrations, task: Task, seed: int, name: str
) -> TaskPredictions:
    actions, _ = policy.predict(test.observations.numpy(), deterministic=True)  # (n, A)
    answers: Sequence[Any] = [env.flat.unflatten(action) for action in actions]
    predicted: ActPredictions | ActionPredictions
    if task is Task.NFD:
        chosen = np.array([answer["action"] for answer in answers], dtype=np.int64)
        free = torch.tensor([float(answer["angle"]) for answer in answers])
        angles = allowed_angle(torch.from_numpy(chosen), free).double().numpy()
        predicted = ActionPredictions(actions=chosen, angles=angles)
    else:
        moves = np.array([answer["move"] for answer in answers], dtype=np.int64)
        predicted = ActPredictions(moves=moves, slots=np.stack([answer["slots"] for answer in answers]).astype(bool))
    return TaskPredictions(
        model=name, seed=seed, task=task, sessions=test.sessions, events=test.events, predicted=predicted, source=name
    )
