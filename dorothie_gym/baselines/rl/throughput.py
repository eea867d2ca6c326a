"""Training throughput, and the shares of its time."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import torch
from stable_baselines3.common.callbacks import BaseCallback

from dorothie_gym.baselines.rl.checkpoint import make_model
from dorothie_gym.baselines.rl.environments import make_training_env
from dorothie_gym.baselines.rl.settings import ON_POLICY, TrainingSettings, tuned_settings
from dorothie_gym.bench.timing import Figures, Progress, ignore_progress, machine, rounded
from dorothie_gym.envs.driving_session import DrivingSession
from dorothie_gym.errors import SettingsError
from dorothie_gym.policies.navigation.instructor import Instructor
from dorothie_gym.processors import available_processors

TARGET = 1000.0
"""Target of environment steps per second, end to end, on two cores."""

SHARES = ("environment", "partners", "policy", "learner")
"""Shares of the time: physics and observations; scripted partners; action selection; learning."""


def measure(
    env: str = "dorothie_gym/Navigation-v0",
    *,
    algorithm: str = "ppo",
    environments: int = 8,
    workers: int | None = None,
    steps: int = 16_384,
    seed: int = 0,
    progress: Progress = ignore_progress,
) -> Figures:
    """Trains for a while in this process, then with worker processes.

    Args:
        env: id of the environment.
        algorithm: one that learns from rollouts: ppo, maskable_ppo or a2c.
        environments: number of parallel environments.
        workers: number of processes of the second run; None for one per processor, 0 leaves the run out.
        steps: number of steps of a run, after a first rollout that is not counted.
        seed: seed of networks and environments.
        progress: called with the name of each stage and the share done.

    Raises:
        SettingsError: an argument is invalid.
    """
    if algorithm not in ON_POLICY:
        raise SettingsError(f"algorithm is {algorithm!r}; it must be one of {', '.join(ON_POLICY)}")
    settings = tuned_settings(algorithm, env, environments=environments, seed=seed, workers=0)
    progress("one process", 0.0)
    alone = _run(settings, steps)
    workers = min(available_processors(), environments) if workers is None else workers
    together: dict[str, float] | None = None
    if workers:
        progress(f"{workers} worker processes", 0.5)
        together = _run(replace(settings, workers=workers), steps)
    total = alone["seconds"]
    partners = alone["partners"]
    shares = (alone["step"] - partners, partners, alone["rollout"] - alone["step"], total - alone["rollout"])
    rates = [steps / run["seconds"] for run in (alone, together) if run is not None]
    return {
        "env": env,
        "algorithm": algorithm,
        "environments": environments,
        "network": list(settings.network),
        "steps": steps,
        "steps_per_second": rounded(max(rates)),
        "one_process_steps_per_second": rounded(rates[0]),
        "workers": workers,
        "workers_steps_per_second": rounded(rates[1]) if together is not None else None,
        "shares": {name: round(value / total, 3) for name, value in zip(SHARES, shares, strict=True)},
        "target": TARGET,
        "machine": machine(),
    }


def _run(settings: TrainingSettings, steps: int) -> dict[str, float]:
    """Returns the durations of a run: total, rollouts, steps of the environments, and partners in these steps [s]."""
    torch.set_num_threads(1)
    vector = make_training_env(settings)
    try:
        with (
            _timed(vector, "step_wait") as step,
            _timed(Instructor, "instruct") as instructing,
            _timed(DrivingSession, "interfere") as interfering,
        ):
            model = make_model(settings, vector)
            model.learn(1, log_interval=None)  # the first rollout compiles and warms up
            for seconds in (step, instructing, interfering):
                seconds[0] = 0.0
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
        "partners": (instructing[0] + interfering[0]) * scale,
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
