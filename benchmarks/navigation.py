"""Steps per second of `Navigation-v0`: as a batch, alone, its physics alone; of highway-env and MetaDrive."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, Final

import numpy as np
from gymnasium.vector import AutoresetMode

from benchmarks.highway_reference import StockIntersection
from benchmarks.metadrive_reference import MetaDriveReference, metadrive_reference
from benchmarks.timing import Figures, Progress, ignore_progress, rounded, wall_seconds
from dorothie_gym.envs.navigation.batch import DrivingBatch
from dorothie_gym.envs.navigation.cameras import DrivingCameras
from dorothie_gym.envs.navigation.decision_state import row_of
from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.envs.navigation_vector_env import NavigationVectorEnv
from dorothie_gym.sim.batch.worlds import VectorWorld
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.state.town_arrays import town_arrays

WARM_UP_DECISIONS: Final = 40
"""Decisions before the measurement."""

KERNEL_DECISIONS: Final = 8
"""Decisions for which a repetition runs the physics alone."""

PARTS: Final = ("physics", "actions", "guidance", "other")
"""Parts of a step: physics; actions and paths; instructor, rewards, observations and masks; resets and the rest."""

PICTURES: Final = "pictures"
"""Further part of a step of environments whose observations are pictures."""


def measure(
    town: str = "brookside",
    *,
    traffic: str = "light",
    exceptions: float = 0.0,
    observation: str = "vector",
    environments: int = 256,
    threads: int | None = None,
    decisions: int = 60,
    repeats: int = 5,
    seed: int = 0,
    progress: Progress = ignore_progress,
) -> Figures:
    """Plays random feasible actions, resets included, and measures alternately in wall-clock time.

    Args:
        town: name or file of a town.
        traffic: traffic density.
        exceptions: average number of exceptions in a session.
        observation: "vector" or "camera".
        environments: number of environments in the batch.
        threads: number of threads; None for one per processor.
        decisions: decisions of the batch in a repetition.
        repeats: number of repetitions; the median counts.
        seed: seed of the sessions and actions.
        progress: callback for the progress.

    Returns:
        `batch_steps_per_second` of all environments together, `kernel_steps_per_second` of the physics of the same
        worlds alone, `single_steps_per_second` of one environment, `stock_steps_per_second` of `intersection-v0`,
        `metadrive_steps_per_second` of MetaDrive or None where it is not installed, and `step_shares` of the time of a
        step of the batch by `PARTS`.
    """
    progress("environments", 0.0)
    rng = np.random.default_rng(seed)
    envs = NavigationVectorEnv(
        environments,
        town,
        traffic=traffic,
        exceptions=exceptions,
        observation=observation,
        threads=threads,
        autoreset_mode=AutoresetMode.SAME_STEP,
    )
    single = NavigationEnv(town, traffic=traffic, exceptions=exceptions, observation=observation)
    envs.reset(seed=seed)
    single.reset(seed=seed)
    references: dict[str, StockIntersection | MetaDriveReference] = {"stock": StockIntersection(seed)}
    camera = envs.config.camera
    metadrive = metadrive_reference(seed, None if camera is None else (camera.width, camera.height))
    if metadrive is not None:
        references["metadrive"] = metadrive
    kernel = _Kernel(envs)
    works: dict[str, Callable[[], tuple[float, int]]] = {
        "batch": lambda: _play_batch(envs, rng, decisions),
        "kernel": kernel.step,
        "single": lambda: _play_single(single, rng, 2 * decisions),
        **{name: partial(_play_reference, reference, 10) for name, reference in references.items()},
    }
    for _ in range(2):
        _play_batch(envs, rng, WARM_UP_DECISIONS // 2)
        _play_single(single, rng, WARM_UP_DECISIONS)
        kernel.step()
    rates: dict[str, list[float]] = {name: [] for name in works}
    spent = {"act_share": 0.0, "guide_share": 0.0, PICTURES: 0.0, "total": 0.0}
    for turn in range(repeats):
        for number, (name, work) in enumerate(works.items()):
            progress(name, (turn + number / len(works)) / repeats)
            with _timed_shares(spent if name == "batch" else {}):
                seconds, steps = work()
            rates[name].append(steps / seconds)
            spent["total"] += seconds if name == "batch" else 0.0
    for reference in references.values():
        reference.close()
    envs.close()
    medians = {name: statistics.median(values) for name, values in rates.items()}
    acting, guiding = spent["act_share"] / spent["total"], spent["guide_share"] / spent["total"]
    physics = min(medians["batch"] / medians["kernel"], acting)
    drawing = spent[PICTURES] / spent["total"]
    shares = dict(zip(PARTS, (physics, acting - physics, guiding, 1.0 - acting - guiding - drawing), strict=True))
    if camera is not None:
        shares[PICTURES] = drawing
    return {
        "town": town,
        "traffic": traffic,
        "exceptions": exceptions,
        "observation": observation,
        "batch": environments,
        "threads": envs.threads,
        "metadrive_steps_per_second": None,
        **{f"{name}_steps_per_second": rounded(rate) for name, rate in medians.items()},
        "of_kernel": round(medians["batch"] / medians["kernel"], 3),
        "step_shares": {name: round(value, 3) for name, value in shares.items()},
        "bytes_per_environment": envs.nbytes // environments,
    }


class _Kernel:
    """Physics of the worlds of a batch, stepped alone from the batch's present state."""

    def __init__(self, envs: NavigationVectorEnv) -> None:
        (self._batch,) = envs.batches
        first = row_of(self._batch.worlds, 0)
        self._worlds = VectorWorld(
            town_arrays(network_of(self._batch.town)), first, envs.num_envs, threads=envs.threads
        )

    def step(self) -> tuple[float, int]:
        """Returns the time of some decisions of physics, and the number of environment steps."""
        self._worlds.arrays = self._batch.worlds.copy()

        def work() -> None:
            for _ in range(KERNEL_DECISIONS):
                self._worlds.step(self._batch.frames, 1.0 / FRAME_RATE)

        return wall_seconds(work), KERNEL_DECISIONS * len(self._worlds)


def _play_batch(envs: NavigationVectorEnv, rng: np.random.Generator, decisions: int) -> tuple[float, int]:
    """Returns the time of some decisions in all environments, without that of choosing actions, and their number."""
    spent = 0.0
    for _ in range(decisions):
        masks = envs.action_masks()
        actions = (rng.random(masks.shape) * masks).argmax(axis=1)
        spent += wall_seconds(partial(envs.step, actions))
    return spent, decisions * envs.num_envs


def _play_single(env: NavigationEnv, rng: np.random.Generator, decisions: int) -> tuple[float, int]:
    """As `_play_batch`, in one environment."""
    spent = 0.0
    for _ in range(decisions):
        action = int(rng.choice(np.flatnonzero(env.action_masks())))
        start = time.perf_counter()
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()
        spent += time.perf_counter() - start
    return spent, decisions


def _play_reference(reference: StockIntersection | MetaDriveReference, steps: int) -> tuple[float, int]:
    """Returns the time of some steps of another simulator's environment, without resets, and their number."""
    spent = 0.0
    for _ in range(steps):
        reference.prepare()
        spent += wall_seconds(reference.step)
    return spent, steps


@contextmanager
def _timed_shares(seconds: dict[str, float]) -> Iterator[None]:
    """Adds the time of the compiled halves of decisions to `seconds`, by the name of the function, and of pictures."""
    share: Any = DrivingBatch.share  # both are replaced for the time of the measurement
    draw: Any = DrivingCameras.draw

    def timed(batch: DrivingBatch, work: Callable[..., None], *arguments: object) -> object:
        start = time.perf_counter()
        events = share(batch, work, *arguments)
        seconds[work.__name__] = seconds.get(work.__name__, 0.0) + time.perf_counter() - start
        return events

    def timed_draw(cameras: DrivingCameras, *arguments: object) -> None:
        start = time.perf_counter()
        draw(cameras, *arguments)
        seconds[PICTURES] = seconds.get(PICTURES, 0.0) + time.perf_counter() - start

    setattr(DrivingBatch, "share", timed)  # noqa: B010  # mypy knows methods as fixed
    setattr(DrivingCameras, "draw", timed_draw)  # noqa: B010  # see above
    try:
        yield
    finally:
        setattr(DrivingBatch, "share", share)  # noqa: B010  # see above
        setattr(DrivingCameras, "draw", draw)  # noqa: B010  # see above
