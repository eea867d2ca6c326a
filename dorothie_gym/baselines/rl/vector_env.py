"""Vector environments: in this process, in worker processes, or in actors of a Ray cluster."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, Final, Protocol, TypeAlias, runtime_checkable

import gymnasium as gym
import numpy as np
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from dorothie_gym.evaluation.rollout.on_ray import RETRIES, connect, reason
from dorothie_gym.evaluation.rollout.processes import exit_with_parent, start_process

AnyEnv: TypeAlias = gym.Env[Any, Any]
"""Environment with vectors as observations; its actions are numbers or vectors, and `gym.Env` is invariant in both."""

MakeEnv: TypeAlias = Callable[[], AnyEnv]
"""Factory of an environment; can be sent to another process."""


@runtime_checkable
class MakeBatch(Protocol):
    """Factory of environments that also have a batch form."""

    def batch(self, count: int) -> VecEnv:
        """Returns several environments as one."""
        ...


def several(make: MakeEnv, count: int) -> VecEnv:
    """Returns several environments in this process, as a batch if the factory makes one."""
    return make.batch(count) if isinstance(make, MakeBatch) else DummyVecEnv([make] * count)


Command: TypeAlias = tuple[str, tuple[Any, ...]]
"""Command to a worker and its arguments, see `execute`."""

Answer: TypeAlias = Any
"""Result of a command, or the message of its error."""


def make_vector_env(make: MakeEnv, environments: int, workers: int, ray: str | None = None) -> VecEnv:
    """Returns several environments as one.

    Args:
        make: makes an environment.
        environments: number of environments.
        workers: number of processes that step them; 0 for this process, or for one per processor of a cluster.
        ray: address of a Ray cluster whose machines step them; None for this machine.

    Raises:
        ProcessError: Ray is not installed, or there is no cluster at the address.
    """
    if ray is not None:
        return RayVecEnv(make, environments, workers, ray)
    return ProcessVecEnv(make, environments, workers) if workers else several(make, environments)


class WorkerVecEnv(VecEnv, ABC):
    """stable-baselines3's interface to environments that workers step, several environments per worker.

    Results depend on seeds and actions only, not on the number of workers. A worker calls `execute` for one command
    after another.
    """

    def __init__(self, environments: int, workers: int) -> None:
        """Asks the workers, which already run, for the spaces.

        Args:
            environments: number of environments; worker k steps those of `shares(environments, workers)[k]`.
            workers: number of workers, at most as many as environments.
        """
        self._shares = shares(environments, workers)
        observation_space, action_space = self._ask("spaces")[0]
        self._closed = False
        super().__init__(environments, observation_space, action_space)

    @abstractmethod
    def _send(self, worker: int, command: Command) -> None:
        """Sends a command to a worker without waiting."""

    @abstractmethod
    def _receive(self, worker: int) -> tuple[bool, Answer]:
        """Returns whether a worker's command succeeded, and its answer."""

    @abstractmethod
    def _end(self) -> None:
        """Ends the workers."""

    def _ask(self, name: str, *arguments: object) -> list[Answer]:
        """Returns the answers of all workers to a command."""
        for worker in range(len(self._shares)):
            self._send(worker, (name, arguments))
        return self._answers(range(len(self._shares)))

    def _ask_some(self, indices: VecEnvIndices, name: str, *arguments: object, **keywords: object) -> list[Answer]:
        """Returns the answers of the environments with these indices, in their order; only these are called."""
        numbers = [range(self.num_envs)[k] for k in self._get_indices(indices)]
        parts = [[k for k in numbers if k in share] for share in self._shares]
        asked = []
        for worker, (share, part) in enumerate(zip(self._shares, parts, strict=True)):
            if part:
                self._send(worker, ("some", (name, [k - share.start for k in part], arguments, keywords)))
                asked.append(worker)
        answers = [answer for own in self._answers(asked) for answer in own]
        order = [k for part in parts for k in part]
        by_number = dict(zip(order, answers, strict=True))
        return [by_number[k] for k in numbers]

    def _answers(self, workers: Iterable[int]) -> list[Answer]:
        """Returns the answers of workers; waits for all workers before raising the error of one."""
        received = [self._receive(worker) for worker in workers]
        for succeeded, answer in received:
            if not succeeded:
                raise RuntimeError(f"an environment failed: {answer}")
        return [answer for _, answer in received]

    # --- stable-baselines3's interface ------------------------------------------------------------------------------

    def reset(self) -> VecEnvObs:
        """Resets all environments with the seeds and options that were set."""
        for worker, share in enumerate(self._shares):
            self._send(worker, ("reset", ([self._seeds[k] for k in share], [self._options[k] for k in share])))
        answers = self._answers(range(len(self._shares)))
        self.reset_infos = [info for _, infos in answers for info in infos]
        self._reset_seeds()
        self._reset_options()
        return np.concatenate([observations for observations, _ in answers])

    def step_async(self, actions: np.ndarray) -> None:
        """Sends the actions to the workers."""
        for worker, share in enumerate(self._shares):
            self._send(worker, ("step", (actions[share.start : share.stop],)))

    def step_wait(self) -> VecEnvStepReturn:
        """Waits for the results of a step."""
        answers = self._answers(range(len(self._shares)))
        observations, rewards, dones, infos = zip(*answers, strict=True)
        all_infos = [info for part in infos for info in part]
        return np.concatenate(observations), np.concatenate(rewards), np.concatenate(dones), all_infos

    def close(self) -> None:
        """Ends the workers."""
        if not self._closed:
            self._closed = True
            self._end()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Answer]:
        """Returns an attribute of the given environments."""
        return self._ask_some(indices, "get_attr", attr_name)

    def set_attr(self, attr_name: str, value: object, indices: VecEnvIndices = None) -> None:
        """Sets an attribute of the given environments."""
        self._ask_some(indices, "set_attr", attr_name, value)

    def env_method(
        self, method_name: str, *method_args: object, indices: VecEnvIndices = None, **method_kwargs: object
    ) -> list[Answer]:
        """Calls a method of the given environments, and returns the results."""
        return self._ask_some(indices, "env_method", method_name, *method_args, **method_kwargs)

    def has_attr(self, attr_name: str) -> bool:
        """Returns whether the environments have an attribute."""
        return all(self._ask("has_attr", attr_name))

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper], indices: VecEnvIndices = None) -> list[bool]:
        """Returns whether each of the given environments has a wrapper."""
        return self._ask_some(indices, "env_is_wrapped", wrapper_class)

    def get_images(self) -> Sequence[None]:
        """Returns no images: workers do not render."""
        return [None] * self.num_envs


def shares(environments: int, workers: int) -> list[range]:
    """Returns the numbers of the environments of each worker."""
    bounds = [environments * k // workers for k in range(workers + 1)]
    return [range(begin, end) for begin, end in itertools.pairwise(bounds)]


def execute(vector: VecEnv, command: Command) -> tuple[bool, Answer]:
    """Executes a command in a worker; returns whether it succeeded, and its result or the message of its error."""
    try:
        return True, _result(vector, *command)
    except Exception as error:  # of any type: the caller raises it
        return False, f"{type(error).__name__}: {error}"


def _result(vector: VecEnv, name: str, arguments: tuple[Any, ...]) -> Answer:
    if name == "step":
        return vector.step(arguments[0])
    if name == "spaces":
        return vector.observation_space, vector.action_space
    if name == "reset":
        vector._seeds, vector._options = arguments
        return vector.reset(), vector.reset_infos
    if name == "has_attr":
        return vector.has_attr(*arguments)
    if name != "some":
        raise ValueError(f"there is no command {name!r}")
    method, indices, positional, keywords = arguments
    answers = getattr(vector, method)(*positional, indices=indices, **keywords)
    return [None] * len(indices) if method == "set_attr" else answers


# --- Processes of this machine ----------------------------------------------------------------------------------------


class ProcessVecEnv(WorkerVecEnv):
    """Environments in worker processes.

    stable-baselines3's own `SubprocVecEnv` starts one process per environment. Where a step takes less than a
    millisecond, the messages of many processes on a few processors cost more time than the processes save.
    """

    def __init__(self, make: MakeEnv, environments: int, workers: int) -> None:
        """Starts the processes.

        Args:
            make: makes an environment.
            environments: number of environments.
            workers: number of processes, at most as many as environments.
        """
        context = get_context("spawn")  # a fork would copy the threads and locks of the caller
        self._connections: list[Connection] = []
        self._processes = []
        for share in shares(environments, workers):
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs, make, len(share)), daemon=True)
            start_process(process)
            theirs.close()
            self._connections.append(ours)
            self._processes.append(process)
        super().__init__(environments, workers)

    def _send(self, worker: int, command: Command) -> None:
        self._connections[worker].send(command)

    def _receive(self, worker: int) -> tuple[bool, Answer]:
        try:
            succeeded, answer = self._connections[worker].recv()
        except (EOFError, ConnectionResetError):
            process = self._processes[worker]
            process.join()
            raise RuntimeError(f"a process that steps environments died with code {process.exitcode}") from None
        return succeeded, answer

    def _end(self) -> None:
        for connection, process in zip(self._connections, self._processes, strict=True):
            connection.close()
            process.join(timeout=5.0)
            if process.is_alive():
                process.kill()


def _serve(connection: Connection, make: MakeEnv, count: int) -> None:
    """Executes commands in a worker process until the connection closes."""
    exit_with_parent()
    vector = several(make, count)
    try:
        while True:
            connection.send(execute(vector, connection.recv()))
    except (EOFError, ConnectionResetError, BrokenPipeError):
        vector.close()  # the caller has closed the connection, perhaps during a step


# --- Machines of a Ray cluster ----------------------------------------------------------------------------------------

_READ_ONLY: Final = ("spaces", "has_attr", "get_attr", "env_is_wrapped", "action_masks", "recorded_episode")
"""Commands, and methods of environments, that change no environment."""


class RayVecEnv(WorkerVecEnv):
    """Environments in actors of a Ray cluster.

    An actor whose process or machine is lost is restarted elsewhere and repeats the commands of the lost one. The
    results are bit-identical to those of processes on one machine.
    """

    def __init__(self, make: MakeEnv, environments: int, workers: int, address: str) -> None:
        """Connects to the cluster and starts the actors.

        Args:
            make: makes an environment.
            environments: number of environments.
            workers: number of actors, at most as many as environments; 0 for one per processor of the cluster.
            address: address of the cluster: "auto", "HOST:PORT", "ray://HOST:PORT"; "local" starts one on this machine.

        Raises:
            ProcessError: Ray is not installed, or there is no cluster at the address.
            RuntimeError: an environment cannot be made there.
        """
        self._ray = connect(address)
        try:
            workers = workers or min(environments, max(1, int(self._ray.cluster_resources().get("CPU", 1))))
            self._make = make
            self._counts = [len(share) for share in shares(environments, workers)]
            self._actors = [self._start(worker) for worker in range(workers)]
            self._sent: list[Command] = [("spaces", ())] * workers
            self._pending: list[Answer] = [None] * workers
            self._history: list[list[Command]] = [[] for _ in range(workers)]
            super().__init__(environments, workers)
        except BaseException:
            self._ray.shutdown()
            raise

    def _start(self, worker: int) -> Answer:
        # Actors reserve no processor, so that a restarted one finds room after a machine is lost.
        remote = self._ray.remote(num_cpus=0, scheduling_strategy="SPREAD")(_Actor)
        return remote.remote(self._make, self._counts[worker])

    def _send(self, worker: int, command: Command) -> None:
        self._sent[worker] = command
        self._pending[worker] = self._actors[worker].execute.remote([command])

    def _receive(self, worker: int) -> tuple[bool, Answer]:
        sent = self._sent[worker]
        for attempt in range(RETRIES + 1):
            try:
                answer: tuple[bool, Answer] = self._ray.get(self._pending[worker])
                break
            except self._ray.exceptions.RayActorError as error:
                if attempt == RETRIES or error.actor_init_failed:
                    raise RuntimeError(
                        f"environments on the cluster were lost {attempt + 1} times: {reason(error)}"
                    ) from None
            self._actors[worker] = self._start(worker)
            self._pending[worker] = self._actors[worker].execute.remote([*self._history[worker], sent])
        if _is_seeded_reset(sent):
            self._history[worker] = [before for before in self._history[worker] if before[0] == "some"]
        if _changes_environment(sent):
            self._history[worker].append(sent)
        return answer

    def _end(self) -> None:
        self._ray.shutdown()


class _Actor:
    """Ray actor that holds a part of the environments."""

    def __init__(self, make: MakeEnv, count: int) -> None:
        self._vector = several(make, count)

    def execute(self, commands: Sequence[Command]) -> tuple[bool, Answer]:
        """Executes commands in order, and returns the answer of the last."""
        return [execute(self._vector, command) for command in commands][-1]


def _is_seeded_reset(command: Command) -> bool:
    """Returns whether a command resets every environment with a seed, which makes earlier commands irrelevant."""
    name, arguments = command
    return name == "reset" and None not in arguments[0]


def _changes_environment(command: Command) -> bool:
    """Returns whether a command can change an environment."""
    name, arguments = command
    method = arguments[0] if name == "some" else name
    if method == "env_method":
        method = arguments[2][0]
    return method not in _READ_ONLY
