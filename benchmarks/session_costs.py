"""Plays sessions of one build of the package in this process, and prints what they cost as JSON.

`sessions.py` runs this file, alternately with builds of different revisions: `python -P session_costs.py SETTINGS`,
with the folder of the build on PYTHONPATH. It imports nothing else of the benchmarks, and only what builds of other
revisions have as well.
"""

from __future__ import annotations

import functools
import gc
import importlib
import inspect
import json
import os
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import FunctionType
from typing import Any, Final

import filterpy.kalman  # noqa: F401  # sessions import it when it is first needed, which takes a second

from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine

try:
    from dorothie_gym.evaluation.rollout.play import SessionCast, play_together
except ImportError:  # a build that plays one session after another
    play_together = None  # type: ignore[assignment]

PARTS: Final[Mapping[str, tuple[str, ...]]] = {
    "physics": ("sim.world:World.step",),
    "observations": (
        "session.observations:SessionObserver.look",
        "session.observations:SessionObserver.observations",
        "session.observations:SessionObserver.views",
    ),
    "decoding": ("session.session_engine:SessionEngine.decode",),
    "hearing": ("session.live_session:LiveSession._deliver",),
    "recording": ("session.recorder:SessionRecorder.record",),
}
"""Methods of the session by part, as module:class.method."""

STAGES: Final[Mapping[Role, str]] = {
    Role.PARTICIPANT: "policies.participant.policy",
    Role.CO_WIZARD: "policies.co_wizard.policy",
}
"""Modules whose functions are the stages of a scripted role."""

OTHER: Final = "other"
"""Name of what belongs to no part."""

WARM_UP: Final = 100_000
"""Distance of the seed of a session that is not counted from the first one that is."""


class PartTimes:
    """Processor time by part; the time of a part that runs within another one counts for itself alone.

    Attributes:
        seconds: processor time by part [s].
        counting: whether time is counted now.

    Args:
        by_role: whether the steps of the policies are parts.
    """

    def __init__(self, *, by_role: bool) -> None:
        self.by_role = by_role
        self.seconds: dict[str, float] = defaultdict(float)
        self.counting = False
        self._running: list[str] = []
        self._since = 0.0

    def timed(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Returns a function whose time counts for a part."""

        @functools.wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            with self.within(part):
                return function(*arguments, **named)

        return call

    @contextmanager
    def within(self, part: str) -> Iterator[None]:
        """Counts the time of a block for a part."""
        self._switch()
        self._running.append(part)
        try:
            yield
        finally:
            self._switch()
            self._running.pop()

    def _switch(self) -> None:
        now = time.process_time()
        if self._running and self.counting:
            self.seconds[self._running[-1]] += now - self._since
        self._since = now


def instrument(times: PartTimes) -> list[str]:
    """Replaces the functions of all parts by timed ones; returns the parts that this build does not have."""
    missing = []
    for part, places in PARTS.items():
        for place in places:
            module, _, path = place.partition(":")
            owner, _, name = path.partition(".")
            holder = getattr(_module(module), owner, None)
            if holder is None or not hasattr(holder, name):
                missing.append(f"{part} ({place})")
            else:
                setattr(holder, name, times.timed(part, getattr(holder, name)))
    for role, module in STAGES.items():
        holder = _module(module)
        for name, function in vars(holder).copy().items() if holder is not None else ():
            if isinstance(function, FunctionType) and _is_stage(function, holder.__name__):
                setattr(holder, name, times.timed(f"{role}: {name.lstrip('_')}", function))
    return missing


def _is_stage(function: FunctionType, module: str) -> bool:
    """Returns whether a function of a policy's module takes its state and the view of a decision."""
    package = module.rpartition(".")[0]
    return function.__module__.startswith(package) and list(inspect.signature(function).parameters)[1:2] == ["view"]


def _module(name: str) -> Any:
    try:
        return importlib.import_module(f"dorothie_gym.{name}")
    except ModuleNotFoundError:
        return None


def costs(
    towns: list[str],
    seeds: list[int],
    co_wizard: str,
    *,
    record: bool,
    parts: bool,
    max_seconds: float,
    at_once: int = 1,
) -> dict[str, Any]:
    """Plays a session of each seed in each town, after one in each town that is not counted.

    Args:
        towns: names or files.
        seeds: seeds of the sessions.
        co_wizard: name of the Co-Wizard's policy; the other roles are scripted.
        record: whether the sessions are recorded.
        parts: whether the time is measured by part, which takes time of its own.
        max_seconds: time limit of a session [s].
        at_once: number of sessions of a town that are played at the same time, by builds that can.

    Returns:
        Number of `decisions`, `simulated_seconds`, processor time in `seconds`; `parts` with the seconds by part,
        `missing` with the parts that this build does not have, and `megabytes` by which the process has grown for each
        session that is played at the same time.
    """
    times = PartTimes(by_role=parts)
    missing = instrument(times) if parts else []
    total: dict[str, Any] = {"decisions": 0, "simulated_seconds": 0.0, "seconds": 0.0, "megabytes": 0.0}
    config = EnvConfig(max_seconds=max_seconds)
    at_once = at_once if play_together is not None else 1
    with tempfile.TemporaryDirectory() as folder:
        for town in towns:
            engines = [SessionEngine(town, config=config)]
            policies = _policies(engines[0], co_wizard, times)
            _play(engines, policies, [seeds[0] + WARM_UP], None, times)
            before = _resident()
            engines += [SessionEngine(town, config=config) for _ in range(at_once - 1)]
            times.counting = True
            for first in range(0, len(seeds), at_once):
                own = seeds[first : first + at_once]
                start = time.process_time()
                _play(engines, policies, own, Path(folder, f"{Path(town).name}-{first}") if record else None, times)
                total["seconds"] += time.process_time() - start
                played = [engine.session for engine in engines[: len(own)]]
                total["decisions"] += sum(session.decisions for session in played)
                total["simulated_seconds"] += sum(session.world.time for session in played)
            times.counting = False
            total["megabytes"] = max(total["megabytes"], (_resident() - before) / at_once)
    return {**total, "parts": dict(times.seconds) if parts else {}, "missing": missing}


def _resident() -> float:
    """Returns the resident memory of this process [MB], after a collection of garbage."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1]) if Path("/proc/self/statm").exists() else 0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _policies(engine: SessionEngine, co_wizard: str, times: PartTimes) -> dict[Role, Any]:
    """Returns the policies of the roles, timed by role where this is wanted."""
    policies: dict[Role, Any] = {}
    for role in AGENT_ROLES:
        policies[role] = make_policy(co_wizard if role is Role.CO_WIZARD else "scripted", role, engine.limits)
        if times.by_role:
            names = ("act_all", "act") if getattr(policies[role], "is_direct", False) else ("step",)
            for name in (name for name in names if hasattr(policies[role], name)):
                setattr(policies[role], name, times.timed(str(role), getattr(policies[role], name)))
    return policies


def _play(
    engines: list[SessionEngine], policies: dict[Role, Any], seeds: list[int], folder: Path | None, times: PartTimes
) -> None:
    """Plays a session of each seed: one, or several at the same time."""
    with times.within(OTHER):
        if len(seeds) == 1:
            play_session(engines[0], policies, seed=seeds[0], folder=folder)
            return
        casts = [
            SessionCast(
                host=engine, policies=policies, seed=seed, folder=None if folder is None else Path(f"{folder}-{seed}")
            )
            for engine, seed in zip(engines, seeds, strict=False)
        ]
        play_together(casts)


if __name__ == "__main__":
    print(json.dumps(costs(**json.loads(sys.argv[1]))))
