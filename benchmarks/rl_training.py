"""Training throughput, and the shares of its time."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import torch
from stable_baselines3.common.callbacks import BaseCallback

from benchmarks import navigation
from benchmarks.timing import Figures, Progress, ignore_progress, machine, rounded
from dorothie_gym.baselines.rl.checkpoint import make_model
from dorothie_gym.baselines.rl.environments import has_batch, make_training_env
from dorothie_gym.baselines.rl.settings import CAMERA, NAVIGATION, ON_POLICY, TrainingSettings, tuned_settings
from dorothie_gym.errors import SettingsError
from dorothie_gym.support.processors import available_processors

ALONE = (
    "batch_steps_per_second",
    "kernel_steps_per_second",
    "single_steps_per_second",
    "stock_steps_per_second",
    "metadrive_steps_per_second",
)
"""Figures without a learner; None for other environments than `Navigation-v0`."""

SHARES = ("environment", "policy", "learner")
"""Shares of the time: steps of the environments; action selection; learning."""


def measure(
    env: str = NAVIGATION,
    *,
    algorithm: str = "ppo",
    observation: str = "vector",
    environments: int | None = None,
    workers: int | None = None,
    steps: int | None = None,
    town: str = "brookside",
    traffic: str = "light",
    exceptions: float = 0.0,
    seed: int = 0,
    progress: Progress = ignore_progress,
) -> Figures:
    """Steps the environments without a learner, where they are a batch, and then trains for a while.

    Args:
        env: id of the environment.
        algorithm: one that learns from rollouts: ppo, maskable_ppo or a2c.
        observation: observation of a driver of the navigation environments: "vector" or "camera".
        environments: number of parallel environments; None for 256, or 16 with pictures.
        workers: number of processes that step them in training; None for none where they are a batch, else one per
            processor.
        steps: number of steps of the training, after a first rollout that is not counted; None for 65,536, or 4,096
            with pictures.
        town: town of the navigation environments.
        traffic: their traffic density.
        exceptions: their average number of exceptions in a session.
        seed: seed of networks and environments.
        progress: called with the name of each stage and the share done.

    Raises:
        SettingsError: an argument is invalid.
    """
    if algorithm not in ON_POLICY:
        raise SettingsError(f"algorithm is {algorithm!r}; it must be one of {', '.join(ON_POLICY)}")
    world: dict[str, object] = {"town": town, "traffic": traffic, "exceptions": exceptions} if env == NAVIGATION else {}
    if observation != "vector":
        world["observation"] = observation
    environments = environments or (16 if observation == CAMERA else 256)
    steps = steps or (4096 if observation == CAMERA else 65_536)
    if workers is None:
        workers = 0 if has_batch(env) else min(available_processors(), environments)
    settings = tuned_settings(algorithm, env, environments=environments, seed=seed, workers=workers, env_settings=world)
    alone: Figures = dict.fromkeys(ALONE)
    if env == NAVIGATION:
        alone = navigation.measure(
            town,
            traffic=traffic,
            exceptions=exceptions,
            observation=observation,
            environments=environments,
            seed=seed,
            progress=lambda part, share: progress(part, 0.5 * share),
        )
    progress("training", 0.5)
    run = _run(settings, steps)
    total = run["seconds"]
    shares = (run["step"], run["rollout"] - run["step"], total - run["rollout"])
    return {
        "env": env,
        "algorithm": algorithm,
        "environments": environments,
        "workers": workers,
        "observation": observation,
        "network": list(settings.network),
        "steps": steps,
        "end_to_end_steps_per_second": rounded(steps / total),
        "shares": {name: round(value / total, 3) for name, value in zip(SHARES, shares, strict=True)},
        **alone,
        "machine": machine(),
    }


def _run(settings: TrainingSettings, steps: int) -> dict[str, float]:
    """Returns the durations of a run: total, rollouts, steps of the environments, and partners in these steps [s]."""
    torch.set_num_threads(1)
    vector = make_training_env(settings)
    try:
        with (
            _timed(vector, "step_wait") as step,
        ):
            model = make_model(settings, vector)
            model.learn(1, log_interval=None)  # the first rollout compiles and warms up
            step[0] = 0.0
            clock = _Clock()
            since, done = time.perf_counter(), model.num_timesteps
            model.learn(steps, callback=clock, reset_num_timesteps=False, log_interval=None)
            spent, more = time.perf_counter() - since, model.num_timesteps - done
    finally:
        vector.close()
    scale = steps / more  # only whole rollouts are played: a few more steps than requested
    return {
        "seconds": spent * scale,
        "rollout": clock.seconds * scale,
        "step": step[0] * scale,
    }


@contextmanager
def _timed(holder: object, name: str) -> Iterator[list[float]]:
    """Measures the time spent in a method; yields a list with the running total [s]."""
    seconds, method = [0.0], getattr(holder, name)
    own = name in vars(holder)

    def timed(*arguments: object, **keywords: object) -> object:
        start = time.perf_counter()
        try:
            return method(*arguments, **keywords)
        finally:
            seconds[0] += time.perf_counter() - start

    setattr(holder, name, timed)
    try:
        yield seconds
    finally:
        if own:
            setattr(holder, name, method)
        else:
            delattr(holder, name)


class _Clock(BaseCallback):
    """Measures the duration of rollouts."""

    def __init__(self) -> None:
        super().__init__()
        self.seconds, self._since = 0.0, 0.0

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        self._since = time.perf_counter()

    def _on_rollout_end(self) -> None:
        self.seconds += time.perf_counter() - self._since
