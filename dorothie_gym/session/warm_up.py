"""Compilation of the simulation ahead of its use, in two processes where there are two processors.

Half of the work is the loop over substeps (`sim.step.step_share`), which a second process compiles at the same time:
it leaves the machine code in the cache, where the first one finds it. Functions that the first seconds of a session may
not call follow there, while the session is already played.
"""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numba.core import event

from dorothie_gym.maps.catalogue import load_town
from dorothie_gym.maps.routing import router
from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.session.actor_table import write_actors
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import noop
from dorothie_gym.sim.batch.threads import turns_of
from dorothie_gym.sim.batch.worlds import alone
from dorothie_gym.sim.config import FRAME_RATE, WorldConfig
from dorothie_gym.sim.ego.decision_setup import note_props
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.pedestrians.walkway_position import closest_walk
from dorothie_gym.sim.sensing.perception import look_around
from dorothie_gym.sim.state.codes import Footway
from dorothie_gym.sim.state.town_arrays import TownArrays, empty_town
from dorothie_gym.sim.state.world_arrays import WorldArrays, empty_world
from dorothie_gym.sim.step import step_share
from dorothie_gym.sim.town_env import TownEnv
from dorothie_gym.support.compilation.dispatcher import CompiledFunction
from dorothie_gym.support.interruption import starting_process
from dorothie_gym.support.processors import available_processors

if TYPE_CHECKING:
    from dorothie_gym.sim.world import World

TOWN: Final = "brookside"
"""Town of the short session that is played; machine code is the same for all towns."""

Progress: TypeAlias = Callable[[str, int, int], None]
"""Called with the name of the function that is being compiled, and the numbers of functions begun and in total."""

_HELPER: Final = """
import os, sys, threading
threading.Thread(target=lambda: os._exit(len(os.read(0, 1))), daemon=True).start()  # the parent's end closes stdin
from dorothie_gym.session.warm_up import LOOP_DONE, compile_loop, compile_rare, reporting
with reporting(lambda name, *_: print(name, flush=True)):
    compile_loop()
    print(LOOP_DONE, flush=True)
    compile_rare()
"""

LOOP_DONE: Final = "the loop is compiled"
"""Line of the second process between its two tasks."""


def is_warm() -> bool:
    """Returns whether the loop over substeps needs no compilation."""
    return not isinstance(step_share, CompiledFunction) or step_share.is_cached()


def warm_up(progress: Progress | None = None, *, everything: bool = False, rare: bool = True) -> None:
    """Compiles the functions of sessions that are not yet in the cache.

    Args:
        progress: called when the compilation of a function begins, perhaps in another thread.
        everything: whether to compile the functions of `Town-v0` as well.
        rare: whether to compile functions that the first seconds of a session may not call before the return. Without
            it a second process, if there is one, compiles them afterwards; it ends with this process at the latest.
    """
    with reporting(progress) as report, _helper(report, goes_on=not rare) as wait:
        engine = SessionEngine(TOWN, config=EnvConfig(world=WorldConfig(vehicles=3, pedestrians=3)))
        engine.reset(seed=0)
        engine.session.observer.observe()
        if rare:
            compile_rare()
        _call_what_follows_a_step(engine.session.world)
        if everything:
            _play(TownEnv())
        wait()
        engine.step({str(role): noop(role, engine.limits) for role in AGENT_ROLES})


def compile_loop(progress: Progress | None = None) -> None:
    """Compiles the loop over substeps."""
    with reporting(progress):
        town, world = _examples()
        if isinstance(step_share, CompiledFunction):
            zeros, answers = np.zeros(1), np.zeros(1, dtype=np.int64)
            step_share.compile_for(turns_of(1, 1), 0, town, alone(world), 1, 1.0 / FRAME_RATE, zeros, zeros, answers)


def _examples() -> tuple[TownArrays, WorldArrays]:
    town = empty_town()
    return town, empty_world(town, vehicles=0, pedestrians=0)


def compile_rare() -> None:
    """Compiles functions that the first seconds of a session may not call, and those of recordings."""
    town, world = _examples()
    if isinstance(write_actors, CompiledFunction):
        write_actors.compile_for(world, np.zeros((0, 8), dtype=np.int64), np.zeros((0, 8)))
    if isinstance(look_around, CompiledFunction) and isinstance(closest_walk, CompiledFunction):
        look_around.compile_for(world, 0, np.zeros((0, 2)))
        closest_walk.compile_for(town, Footway.STREET, 0.0, 0.0, 0.0)
    search = router(load_town(TOWN))
    search.reachable((0, 0.0))
    search.costs_to((0, 0.0))
    TownNetwork(load_town(TOWN)).lane_of(0).local_coordinates(np.zeros(2))


def _call_what_follows_a_step(world: World) -> None:
    """Calls the functions that read a step of a world, while the second process compiles the step."""
    world.visibility.signal(1.0)
    note_props(world.actors.arrays, 0)


def _play(env: TownEnv) -> None:
    env.reset(seed=0)
    env.step(env.action_space.sample())
    env.close()


# --- Progress ---------------------------------------------------------------------------------------------------------


class _Reports(event.Listener):
    """Reports functions whose compilation begins, here or in the second process."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._planned = len(_compiled_functions())
        self._begun: set[str] = set()
        self._lock = threading.Lock()

    def on_start(self, event: event.Event) -> None:
        function = event.data["dispatcher"].py_func
        self(f"{function.__module__}.{function.__qualname__}")

    def on_end(self, event: event.Event) -> None:
        """Ignores ends: functions are nested, and the name on display stays that of the last one begun."""

    def __call__(self, name: str) -> None:
        with self._lock:
            self._begun.add(name)
            done = len(self._begun)
        self._progress(name.removeprefix("dorothie_gym."), done, max(self._planned, done))


def _compiled_functions() -> set[str]:
    """Returns the names of all compiled functions of the package that are imported."""
    modules = [module for name, module in sys.modules.items() if name.startswith("dorothie_gym.")]
    values = [value for module in modules for value in vars(module).values()]
    return {
        f"{value.py_func.__module__}.{value.py_func.__qualname__}"
        for value in values
        if isinstance(value, CompiledFunction)
    }


@contextmanager
def reporting(progress: Progress | None) -> Iterator[Callable[[str], None]]:
    """Calls `progress` for each function that this process begins to compile; also yields a function for such calls."""
    if progress is None:
        yield lambda name: None
        return
    reports = _Reports(progress)
    with event.install_listener("numba:compile", reports):
        yield reports


@contextmanager
def _helper(report: Callable[[str], None], *, goes_on: bool) -> Iterator[Callable[[], object]]:
    """Compiles the loop in a second process; yields a function that waits until it is done.

    Args:
        report: called with the names of the functions that it compiles.
        goes_on: whether the process may go on with rare functions after the block.
    """
    if is_warm() or available_processors() < 2:
        yield lambda: None
        return
    path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)  # the package may be anywhere on it
    with starting_process():
        process = subprocess.Popen(
            [sys.executable, "-c", _HELPER],
            env={**os.environ, "PYTHONPATH": path},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
    done = threading.Event()
    threading.Thread(target=_forward, args=(process, report, done), daemon=True).start()
    try:
        yield done.wait  # if the process failed, this one compiles the missing functions
    except BaseException:
        goes_on = False
        raise
    finally:
        if goes_on:
            atexit.register(_stop, process)
        else:
            _stop(process)


def _stop(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    process.kill()
    process.stdin.close()
    process.wait()


def _forward(process: subprocess.Popen[str], report: Callable[[str], None], done: threading.Event) -> None:
    """Reports the names that the second process prints, until it ends; sets an event when the loop is compiled."""
    assert process.stdout is not None
    with process.stdout:
        for line in process.stdout:
            if line.strip() == LOOP_DONE:
                done.set()
            elif not done.is_set():
                report(f"dorothie_gym.{line.strip()}")
    done.set()
