"""Sessions played by a Ray cluster: each is a task, and comes back as files, so that no folder has to be shared."""

from __future__ import annotations

import socket
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeVar

from dorothie_gym.errors import ProcessError
from dorothie_gym.recording import SessionState, session_state
from dorothie_gym.rollout.folder import PARTS
from dorothie_gym.rollout.play import Planned

Plan = TypeVar("Plan", bound=Planned)
Result = TypeVar("Result")

RETRIES: Final = 8
"""So often a session is begun anew whose process or machine was lost; after that it is taken to be its own fault."""

KNOCK: Final = 10.0
"""So long it is waited for a cluster to answer [s]."""


def share_out_on_ray(
    prepare: Callable[[Path], Callable[[Plan], Result]], plans: Sequence[Plan], root: Path, *, address: str
) -> Iterator[Result]:
    """Plays sessions on a cluster, keeps them in a folder here, and yields what comes of them as it comes.

    Sessions that are in the folder already are dealt with here. One whose process or machine is lost is begun anew on
    another. The cluster's machines need this package in the same version, and files of learned players at the same
    path.

    Args:
        prepare: called with the folder of all sessions, there a temporary one, returns what makes a session in it.
        plans: the sessions.
        root: folder of all sessions here, held by `making_in`.
        address: of the cluster: "auto", "HOST:PORT", "ray://HOST:PORT"; "local" begins one on this machine.

    Raises:
        ProcessError: Ray is not installed, there is no cluster at the address, or a session failed there.
    """
    here = [plan for plan in plans if session_state(root / plan.path) is SessionState.FINISHED]
    if here:
        deal_with = prepare(root)
        for plan in here:
            yield deal_with(plan)
    there = {plan.path: plan for plan in plans if plan not in here}
    if not there:
        return
    ray = connect(address)
    try:
        remote = ray.remote(num_cpus=1, max_retries=RETRIES)(_play)
        waiting = {remote.remote(prepare, plan): plan for plan in there.values()}
        while waiting:
            (done, *_), _ = ray.wait(list(waiting))
            plan = waiting.pop(done)
            try:
                result, files = ray.get(done)
            except ray.exceptions.RayError as error:
                raise ProcessError(f"{plan}: {reason(error)}") from None
            _keep(root, plan.path, files)
            yield result
    finally:
        ray.shutdown()


def connect(address: str) -> Any:
    """Returns Ray, connected to a cluster; whoever asks for it shuts it down.

    Args:
        address: of the cluster, see `share_out_on_ray`.

    Raises:
        ProcessError: Ray is not installed, or there is no cluster at the address.
    """
    try:
        import ray
    except ImportError:
        raise ProcessError("Ray is not installed; install dorothie-gym[ray]") from None
    try:
        _knock(address)
        ray.init(address=address, log_to_driver=False, logging_level="error")
    except (OSError, ValueError, RuntimeError) as error:
        raise ProcessError(f"there is no Ray cluster at {address!r} ({error}); see `ray start --help`") from None
    return ray


def _knock(address: str) -> None:
    """Raises `OSError` where nobody listens at HOST:PORT: Ray itself would go on trying for minutes."""
    host, separator, port = address.removeprefix("ray://").rpartition(":")
    if separator:
        socket.create_connection((host, int(port)), timeout=KNOCK).close()


def _play(prepare: Callable[[Path], Callable[[Plan], Result]], plan: Plan) -> tuple[Result, dict[str, bytes]]:
    """What a machine of the cluster does: a session in a temporary folder; returns what came of it and its files."""
    with tempfile.TemporaryDirectory(prefix="dorothie_gym-") as folder:
        root = Path(folder)
        (root / PARTS).mkdir()
        result = prepare(root)(plan)
        session = root / plan.path
        files = (path for path in sorted(session.rglob("*")) if path.is_file())
        return result, {path.relative_to(session).as_posix(): path.read_bytes() for path in files}


def _keep(root: Path, path: str, files: Mapping[str, bytes]) -> None:
    """Writes a session's files; it appears in its folder whole or not at all. One that failed has none."""
    if not files:
        return
    part, folder = root / PARTS / Path(path).name, root / path
    for name, content in files.items():
        (part / name).parent.mkdir(parents=True, exist_ok=True)
        (part / name).write_bytes(content)
    folder.parent.mkdir(parents=True, exist_ok=True)
    part.rename(folder)


def reason(error: BaseException) -> str:
    """The error of the session itself, where it is known."""
    cause = getattr(error, "cause", None)
    lines = [line for line in str(error).splitlines() if line.strip()]
    return f"{type(cause).__name__}: {cause}" if cause is not None else lines[-1] if lines else type(error).__name__
