"""Environments in a few processes, several in each: one message there and one back for a step of all."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv


class WorkerVecEnv(VecEnv):
    """stable-baselines3's interface to environments that are shared out among processes.

    Its own `SubprocVecEnv` starts a process for each environment; where a step takes less than a millisecond, the
    messages of many processes on a few cores cost more than they win.

    What happens depends on the seeds and actions only, not on the number of processes.
    """

    def __init__(self, make: Callable[[], gym.Env[Any, Any]], environments: int, workers: int) -> None:
        """Starts the processes.

        Args:
            make: makes an environment; can be sent to another process.
            environments: how many.
            workers: how many processes, at most as many as environments.
        """
        context = get_context("spawn")  # a fork would copy whatever threads and locks the caller has
        bounds = [environments * k // workers for k in range(workers + 1)]
        self._shares = [range(begin, end) for begin, end in zip(bounds[:-1], bounds[1:], strict=True)]
        self._connections: list[Connection] = []
        self._processes = []
        for share in self._shares:
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs, make, len(share)), daemon=True)
            process.start()
            theirs.close()
            self._connections.append(ours)
            self._processes.append(process)
        observed, acted = self._ask("spaces")[0]
        self._closed = False
        super().__init__(environments, observed, acted)

    def _ask(self, command: str, *arguments: Any) -> list[Any]:
        """Answers of all processes."""
        for connection in self._connections:
            connection.send((command, arguments))
        return self._answers(self._connections)

    def _ask_some(self, indices: Any, command: str, *arguments: Any, **named: Any) -> list[Any]:
        """Answers of the environments with these indices, in their order; the other environments are left alone."""
        numbers = [range(self.num_envs)[k] for k in self._get_indices(indices)]
        parts = [[k for k in numbers if k in share] for share in self._shares]
        asked = []
        for share, connection, part in zip(self._shares, self._connections, parts, strict=True):
            if part:
                connection.send(("some", (command, [k - share.start for k in part], arguments, named)))
                asked.append(connection)
        answers = [answer for own in self._answers(asked) for answer in own]
        order = [k for part in parts for k in part]
        by_number = dict(zip(order, answers, strict=True))
        return [by_number[k] for k in numbers]

    def _answers(self, connections: Iterable[Connection]) -> list[Any]:
        """What processes answer; all of them are heard before it is told that one failed."""
        received = [self._receive(connection) for connection in connections]
        for done, answer in received:
            if not done:
                raise RuntimeError(f"an environment failed: {answer}")
        return [answer for _, answer in received]

    def _receive(self, connection: Connection) -> tuple[bool, Any]:
        try:
            done, answer = connection.recv()
        except (EOFError, ConnectionResetError):
            process = self._processes[self._connections.index(connection)]
            process.join()
            raise RuntimeError(f"a process that steps environments died with code {process.exitcode}") from None
        return done, answer

    # --- stable-baselines3's interface ------------------------------------------------------------------------------

    def reset(self) -> Any:
        """Resets all environments with the seeds and options that were set."""
        for share, connection in zip(self._shares, self._connections, strict=True):
            seeds = [self._seeds[k] for k in share]
            connection.send(("reset", (seeds, [self._options[k] for k in share])))
        answers = self._answers(self._connections)
        self.reset_infos = [info for _, infos in answers for info in infos]
        self._reset_seeds()
        self._reset_options()
        return np.concatenate([observations for observations, _ in answers])

    def step_async(self, actions: Any) -> None:
        """Sends the actions out."""
        for share, connection in zip(self._shares, self._connections, strict=True):
            connection.send(("step", (actions[share.start : share.stop],)))

    def step_wait(self) -> Any:
        """Waits for what came of them."""
        answers = self._answers(self._connections)
        observations, rewards, dones, infos = zip(*answers, strict=True)
        told = [info for part in infos for info in part]
        return np.concatenate(observations), np.concatenate(rewards), np.concatenate(dones), told

    def close(self) -> None:
        """Ends the processes."""
        if self._closed:
            return
        self._closed = True
        for connection, process in zip(self._connections, self._processes, strict=True):
            connection.close()
            process.join(timeout=5.0)
            if process.is_alive():
                process.kill()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of some environments."""
        return self._ask_some(indices, "get_attr", attr_name)

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Sets an attribute of some environments."""
        self._ask_some(indices, "set_attr", attr_name, value)

    def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **named: Any) -> list[Any]:
        """Calls a method of some environments; returns what they answer."""
        return self._ask_some(indices, "env_method", method_name, *arguments, **named)

    def has_attr(self, attr_name: str) -> bool:
        """Whether the environments have an attribute."""
        return all(self._ask("has_attr", attr_name))

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Whether some environments are wrapped so."""
        return self._ask_some(indices, "env_is_wrapped", wrapper_class)

    def get_images(self) -> list[Any]:
        """Pictures are not drawn by workers."""
        return [None] * self.num_envs


def _serve(connection: Connection, make: Callable[[], gym.Env[Any, Any]], count: int) -> None:
    """What a process does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the caller decides what it means
    vector = DummyVecEnv([make] * count)
    try:
        while True:
            command, arguments = connection.recv()
            try:
                answer = True, _carry_out(vector, command, arguments)
            except Exception as error:  # whatever it is, the caller is told
                answer = False, f"{type(error).__name__}: {error}"
            connection.send(answer)
    except (EOFError, ConnectionResetError, BrokenPipeError):
        vector.close()  # the caller has hung up, perhaps in the middle of a step


def _carry_out(vector: DummyVecEnv, command: str, arguments: tuple[Any, ...]) -> Any:
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
