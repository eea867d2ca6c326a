"""Environments on the machines of a Ray cluster."""

from __future__ import annotations

from typing import Any, Final

from stable_baselines3.common.vec_env import DummyVecEnv

from dorothie_gym.baselines.rl.vector_env import MakeEnv, SharedVecEnv, carry_out, share_of
from dorothie_gym.rollout.on_ray import RETRIES, connect, reason

Sent = tuple[str, tuple[Any, ...]]
"""A command and its arguments."""

_QUESTIONS: Final = ("spaces", "has_attr", "get_attr", "env_is_wrapped", "action_masks")
"""Commands that change no environment."""


class RayVecEnv(SharedVecEnv):
    """Environments that are shared out among actors of a Ray cluster.

    An actor whose process or machine is lost is begun anew on another, and does again what the lost one had been sent:
    what comes of a training is what came of it with processes of one machine, to the last bit.
    """

    def __init__(self, make: MakeEnv, environments: int, workers: int, address: str) -> None:
        """Connects to the cluster, and starts the actors.

        Args:
            make: makes an environment.
            environments: how many.
            workers: how many actors, at most as many as environments; 0: one for each processor of the cluster.
            address: of the cluster: "auto", "HOST:PORT", "ray://HOST:PORT"; "local" begins one on this machine.

        Raises:
            ProcessError: Ray is not installed, or there is no cluster at the address.
            RuntimeError: an environment cannot be made there.
        """
        self._ray = connect(address)
        try:
            workers = workers or min(environments, max(1, int(self._ray.cluster_resources().get("CPU", 1))))
            self._make = make
            self._counts = [len(share) for share in share_of(environments, workers)]
            self._actors = [self._begin(worker) for worker in range(workers)]
            self._sent: list[Sent] = [("spaces", ())] * workers
            self._answers_due: list[Any] = [None] * workers
            self._journals: list[list[Sent]] = [[] for _ in range(workers)]
            super().__init__(environments, workers)
        except BaseException:
            self._ray.shutdown()
            raise

    def _begin(self, worker: int) -> Any:
        # They ask for no processor of their own, so that one that is begun anew finds room when a machine is lost.
        remote = self._ray.remote(num_cpus=0, scheduling_strategy="SPREAD")(_Actor)
        return remote.remote(self._make, self._counts[worker])

    def _send(self, worker: int, command: str, arguments: tuple[Any, ...]) -> None:
        self._sent[worker] = (command, arguments)
        self._answers_due[worker] = self._actors[worker].carry_out.remote([(command, arguments)])

    def _receive(self, worker: int) -> tuple[bool, Any]:
        sent = self._sent[worker]
        for attempt in range(RETRIES + 1):
            try:
                answer: tuple[bool, Any] = self._ray.get(self._answers_due[worker])
                break
            except self._ray.exceptions.RayActorError as error:
                if attempt == RETRIES or error.actor_init_failed:
                    raise RuntimeError(
                        f"environments on the cluster were lost again and again: {reason(error)}"
                    ) from None
            self._actors[worker] = self._begin(worker)
            self._answers_due[worker] = self._actors[worker].carry_out.remote([*self._journals[worker], sent])
        if _begins_all(sent):
            self._journals[worker] = [before for before in self._journals[worker] if before[0] == "some"]
        if _changes(sent):
            self._journals[worker].append(sent)
        return answer

    def _end(self) -> None:
        self._ray.shutdown()


class _Actor:
    """Ray actor that holds some environments."""

    def __init__(self, make: MakeEnv, count: int) -> None:
        self._vector = DummyVecEnv([make] * count)

    def carry_out(self, commands: list[Sent]) -> tuple[bool, Any]:
        """Does what it is sent, in order; returns what came of the last."""
        return [carry_out(self._vector, *command) for command in commands][-1]


def _begins_all(sent: Sent) -> bool:
    """Returns whether a command resets every environment with a seed, which makes earlier commands irrelevant."""
    command, arguments = sent
    return command == "reset" and None not in arguments[0]


def _changes(sent: Sent) -> bool:
    """Returns whether a command can change an environment."""
    command, arguments = sent
    asked = arguments[0] if command == "some" else command
    if asked == "env_method":
        asked = arguments[2][0]
    return asked not in _QUESTIONS
