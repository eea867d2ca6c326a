"""Sessions on a Ray cluster: each session is a task that returns its files, so that no shared folder is needed."""

from __future__ import annotations

import socket
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeVar

from dorothie_gym.errors import ProcessError
from dorothie_gym.evaluation.rollout.folder import PARTS_FOLDER, PlannedSession
from dorothie_gym.session.recording.files import SessionState
from dorothie_gym.session.recording.session import session_state
from dorothie_gym.support.installation import pip_install

Plan = TypeVar("Plan", bound=PlannedSession)
Result = TypeVar("Result")

RETRIES: Final = 8
"""Number of times that a session is restarted whose process or machine was lost; then the session counts as failed."""

CONNECT_TIMEOUT: Final = 10.0
"""Longest wait for the cluster to accept a connection [s]."""


def run_on_ray(
    prepare: Callable[[Path], Callable[[Plan], Result]], plans: Sequence[Plan], root: Path, *, address: str
) -> Iterator[Result]:
    """Plays sessions on a cluster, stores them in a local folder, and yields each result when it arrives.

    Finished sessions of the folder are evaluated locally. A session whose process or machine is lost is restarted on
    another. The machines of the cluster need the same version of this package, and model files at the same path.

    Args:
        prepare: called with the folder of all sessions (on the cluster a temporary one); returns the function that
            plays a session in it.
        plans: the sessions.
        root: local folder of all sessions, locked by `locked_folder`.
        address: address of the cluster: "auto", "HOST:PORT", "ray://HOST:PORT"; "local" starts one on this machine.

    Raises:
        ProcessError: Ray is not installed, there is no cluster at the address, or a session failed there.
    """
    here = [plan for plan in plans if session_state(root / plan.path) is SessionState.FINISHED]
    if here:
        evaluate = prepare(root)
        for plan in here:
            yield evaluate(plan)
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
            _store(root, plan.path, files)
            yield result
    finally:
        ray.shutdown()


def connect(address: str) -> Any:  # Ray is optional and has no types for mypy
    """Returns the module `ray`, connected to a cluster; the caller shuts it down.

    Args:
        address: address of the cluster, see `run_on_ray`.

    Raises:
        ProcessError: Ray is not installed, or there is no cluster at the address.
    """
    try:
        import ray
    except ImportError:
        raise ProcessError(f"Ray is not installed; run: {pip_install('ray')}") from None
    try:
        _check_address(address)
        ray.init(address=address, log_to_driver=False, logging_level="error")
    except (OSError, ValueError, RuntimeError) as error:
        raise ProcessError(f"there is no Ray cluster at {address!r} ({error}); see `ray start --help`") from None
    return ray


def _check_address(address: str) -> None:
    """Raises `OSError` where HOST:PORT accepts no connection: Ray itself would retry for minutes."""
    host, separator, port = address.removeprefix("ray://").rpartition(":")
    if separator:
        socket.create_connection((host, int(port)), timeout=CONNECT_TIMEOUT).close()


def _play(prepare: Callable[[Path], Callable[[Plan], Result]], plan: Plan) -> tuple[Result, dict[str, bytes]]:
    """Plays a session in a temporary folder on a machine of the cluster; returns its result and its files."""
    with tempfile.TemporaryDirectory(prefix="dorothie_gym-") as folder:
        root = Path(folder)
        (root / PARTS_FOLDER).mkdir()
        result = prepare(root)(plan)
        session = root / plan.path
        files = (path for path in sorted(session.rglob("*")) if path.is_file())
        return result, {path.relative_to(session).as_posix(): path.read_bytes() for path in files}


def _store(root: Path, path: str, files: Mapping[str, bytes]) -> None:
    """Writes the files of a session, whose folder appears in one step; a failed session has no files."""
    if not files:
        return
    part, folder = root / PARTS_FOLDER / Path(path).name, root / path
    for name, content in files.items():
        (part / name).parent.mkdir(parents=True, exist_ok=True)
        (part / name).write_bytes(content)
    folder.parent.mkdir(parents=True, exist_ok=True)
    part.rename(folder)


def reason(error: BaseException) -> str:
    """Returns the error of the session itself if Ray reports it, otherwise the last line of Ray's message."""
    cause = getattr(error, "cause", None)
    lines = [line for line in str(error).splitlines() if line.strip()]
    return f"{type(cause).__name__}: {cause}" if cause is not None else lines[-1] if lines else type(error).__name__
