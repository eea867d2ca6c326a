"""Environments in a few processes of this machine."""

from __future__ import annotations

import signal
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

from stable_baselines3.common.vec_env import DummyVecEnv

from dorothie_gym.baselines.rl.sharing import Make, SharedVecEnv, carry_out, share_of


class WorkerVecEnv(SharedVecEnv):
    """Environments that are shared out among processes.

    stable-baselines3's own `SubprocVecEnv` starts a process for each environment; where a step takes less than a
    millisecond, the messages of many processes on a few cores cost more than they win.
    """

    def __init__(self, make: Make, environments: int, workers: int) -> None:
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


def _serve(connection: Connection, make: Make, count: int) -> None:
    """What a process does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the caller decides what it means
    vector = DummyVecEnv([make] * count)
    try:
        while True:
            command, arguments = connection.recv()
            connection.send(carry_out(vector, command, arguments))
    except (EOFError, ConnectionResetError, BrokenPipeError):
        vector.close()  # the caller has hung up, perhaps in the middle of a step
