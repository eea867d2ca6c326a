"""Vector environments whose environments are shared out among workers, several to each."""

from __future__ import annotations

import itertools
import signal
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

MakeEnv = Callable[[], gym.Env[Any, Any]]
"""Makes an environment; can be sent to another process."""


class SharedVecEnv(VecEnv, ABC):
    """stable-baselines3's interface to environments that workers step, each a few of them.

    Results depend on seeds and actions only, not on the number of workers. A worker executes commands with
    `carry_out`, one command after another.
    """

    def __init__(self, environments: int, workers: int) -> None:
        """Asks the workers, which are there already, for the spaces.

        Args:
            environments: how many; worker k has those of `share_of(environments, workers)[k]`.
            workers: how many, at most as many as environments.
        """
        self._shares = share_of(environments, workers)
        observed, acted = self._ask("spaces")[0]
        self._closed = False
        super().__init__(environments, observed, acted)

    @abstractmethod
    def _send(self, worker: int, command: str, arguments: tuple[Any, ...]) -> None:
        """Sends a command to a worker, and does not wait."""

    @abstractmethod
    def _receive(self, worker: int) -> tuple[bool, Any]:
        """Returns whether a worker's command succeeded, and its answer or error."""

    @abstractmethod
    def _end(self) -> None:
        """Ends the workers."""

    def _ask(self, command: str, *arguments: Any) -> list[Any]:
        """Answers of all workers."""
        for worker in range(len(self._shares)):
            self._send(worker, command, arguments)
        return self._answers(range(len(self._shares)))

    def _ask_some(self, indices: Any, command: str, *arguments: Any, **named: Any) -> list[Any]:
        """Answers of the environments with these indices, in their order; the other environments are left alone."""
        numbers = [range(self.num_envs)[k] for k in self._get_indices(indices)]
        parts = [[k for k in numbers if k in share] for share in self._shares]
        asked = []
        for worker, (share, part) in enumerate(zip(self._shares, parts, strict=True)):
            if part:
                self._send(worker, "some", (command, [k - share.start for k in part], arguments, named))
                asked.append(worker)
        answers = [answer for own in self._answers(asked) for answer in own]
        order = [k for part in parts for k in part]
        by_number = dict(zip(order, answers, strict=True))
        return [by_number[k] for k in numbers]

    def _answers(self, workers: Iterable[int]) -> list[Any]:
        """Returns the answers of workers; waits for all before it raises the error of one."""
        received = [self._receive(worker) for worker in workers]
        for done, answer in received:
            if not done:
                raise RuntimeError(f"an environment failed: {answer}")
        return [answer for _, answer in received]

    # --- stable-baselines3's interface ------------------------------------------------------------------------------

    def reset(self) -> Any:
        """Resets all environments with the seeds and options that were set."""
        for worker, share in enumerate(self._shares):
            self._send(worker, "reset", ([self._seeds[k] for k in share], [self._options[k] for k in share]))
        answers = self._answers(range(len(self._shares)))
        self.reset_infos = [info for _, infos in answers for info in infos]
        self._reset_seeds()
        self._reset_options()
        return np.concatenate([observations for observations, _ in answers])

    def step_async(self, actions: Any) -> None:
        """Sends the actions to the workers."""
        for worker, share in enumerate(self._shares):
            self._send(worker, "step", (actions[share.start : share.stop],))

    def step_wait(self) -> Any:
        """Waits for the results of a step."""
        answers = self._answers(range(len(self._shares)))
        observations, rewards, dones, infos = zip(*answers, strict=True)
        told = [info for part in infos for info in part]
        return np.concatenate(observations), np.concatenate(rewards), np.concatenate(dones), told

    def close(self) -> None:
        """Ends the workers."""
        if not self._closed:
            self._closed = True
            self._end()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Returns an attribute of some environments."""
        return self._ask_some(indices, "get_attr", attr_name)

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Sets an attribute of some environments."""
        self._ask_some(indices, "set_attr", attr_name, value)

    def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **named: Any) -> list[Any]:
        """Calls a method of some environments; returns what they answer."""
        return self._ask_some(indices, "env_method", method_name, *arguments, **named)

    def has_attr(self, attr_name: str) -> bool:
        """Returns whether the environments have an attribute."""
        return all(self._ask("has_attr", attr_name))

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Returns whether some environments have a wrapper."""
        return self._ask_some(indices, "env_is_wrapped", wrapper_class)

    def get_images(self) -> list[Any]:
        """Pictures are not drawn by workers."""
        return [None] * self.num_envs


def share_of(environments: int, workers: int) -> list[range]:
    """Numbers of the environments that each worker has."""
    bounds = [environments * k // workers for k in range(workers + 1)]
    return [range(begin, end) for begin, end in itertools.pairwise(bounds)]


def carry_out(vector: DummyVecEnv, command: str, arguments: tuple[Any, ...]) -> tuple[bool, Any]:
    """Does what a worker is sent; returns whether it could be done, and the answer, or else what went wrong."""
    try:
        return True, _done(vector, command, arguments)
    except Exception as error:  # of any type: the caller raises it
        return False, f"{type(error).__name__}: {error}"


def _done(vector: DummyVecEnv, command: str, arguments: tuple[Any, ...]) -> Any:
    if command == "step":
        return vector.step(arguments[0])
    if command == "spaces":
        return vector.observation_space, vector.action_space
    if command == "reset":
        vector._seeds, vector._options = arguments
        return vector.reset(), vector.reset_infos
    if command == "has_attr":
        return vector.has_attr(*arguments)
    assert command == "some", command
    name, places, positional, named = arguments
    answers = getattr(vector, name)(*positional, indices=places, **named)
    return [None] * len(places) if name == "set_attr" else answers


# --- Environments in a few processes of this machine -----------------------------------------------------------------


class WorkerVecEnv(SharedVecEnv):
    """Environments that are shared out among processes.

    stable-baselines3's own `SubprocVecEnv` starts a process for each environment; where a step takes less than a
    millisecond, the messages of many processes on a few cores cost more than they win.
    """

    def __init__(self, make: MakeEnv, environments: int, workers: int) -> None:
        """Starts the processes.

        Args:
            make: makes an environment.
            environments: how many.
            workers: how many processes, at most as many as environments.
        """
        context = get_context("spawn")  # a fork would copy whatever threads and locks the caller has
        self._connections: list[Connection] = []
        self._processes = []
        for share in share_of(environments, workers):
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs, make, len(share)), daemon=True)
            process.start()
            theirs.close()
            self._connections.append(ours)
            self._processes.append(process)
        super().__init__(environments, workers)

    def _send(self, worker: int, command: str, arguments: tuple[Any, ...]) -> None:
        self._connections[worker].send((command, arguments))

    def _receive(self, worker: int) -> tuple[bool, Any]:
        try:
            done, answer = self._connections[worker].recv()
        except (EOFError, ConnectionResetError):
            process = self._processes[worker]
            process.join()
            raise RuntimeError(f"a process that steps environments died with code {process.exitcode}") from None
        return done, answer

    def _end(self) -> None:
        for connection, process in zip(self._connections, self._processes, strict=True):
            connection.close()
            process.join(timeout=5.0)
            if process.is_alive():
                process.kill()


def _serve(connection: Connection, make: MakeEnv, count: int) -> None:
    """Serves commands in a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the caller decides what it means
    vector = DummyVecEnv([make] * count)
    try:
        while True:
            command, arguments = connection.recv()
            connection.send(carry_out(vector, command, arguments))
    except (EOFError, ConnectionResetError, BrokenPipeError):
        vector.close()  # the caller has hung up, perhaps in the middle of a step
