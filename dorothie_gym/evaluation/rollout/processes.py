"""Pool of worker processes that end with the process that started them.

`concurrent.futures.ProcessPoolExecutor` was tried: when a worker dies, it reports neither the task nor the exit code,
and before Python 3.14 it cannot end a running task without private attributes, so that Ctrl-C would wait for a session.
`joblib.Parallel` (loky) was tried as well: it is as fast and ends at Ctrl-C, but it does not name the task of a dead
worker, and its workers outlive a caller that is killed.
"""

from __future__ import annotations

import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Final, Generic, TypeVar

from dorothie_gym.errors import EndpointError, ProcessError
from dorothie_gym.support.interruption import starting_process

Task = TypeVar("Task")
Result = TypeVar("Result")


def run_tasks(
    prepare: Callable[[], Callable[[Task], Result]], tasks: Iterable[Task], *, workers: int
) -> Iterator[Result]:
    """Runs tasks in worker processes, and yields each result when its task is done, in any order.

    Tasks and results travel through pipes. When the iterator is closed before the end, the processes are killed.

    Args:
        prepare: called once in each process; returns the function that runs a task. It must be picklable.
        tasks: tasks to run.
        workers: number of processes; 1 runs the tasks in the calling process.

    Raises:
        EndpointError: the endpoint of a language model rejects the calls of a task.
        ProcessError: a task failed in another process, or its process died.
        OSError: a file cannot be read or written.
    """
    yield from run_series(_OneResult(prepare), tasks, workers=workers)


def run_series(
    prepare: Callable[[], Callable[[Task], Iterable[Result]]], tasks: Iterable[Task], *, workers: int
) -> Iterator[Result]:
    """Runs tasks with several results each, as `run_tasks`, and yields each result as soon as its task has it.

    Args:
        prepare: called once in each process; returns the function that runs a task. It must be picklable.
        tasks: tasks to run.
        workers: number of processes; 1 runs the tasks in the calling process.

    Raises:
        EndpointError: the endpoint of a language model rejects the calls of a task.
        ProcessError: a task failed in another process, or its process died.
        OSError: a file cannot be read or written.
    """
    waiting = list(reversed(list(tasks)))
    if workers == 1:
        work = prepare()
        while waiting:
            yield from work(waiting.pop())
        return
    pool: list[_Worker[Task, Result]] = []
    try:
        for _ in range(min(workers, len(waiting))):
            pool.append(_Worker(prepare))
        for worker in pool:
            worker.submit(waiting.pop())
        busy = {worker.connection: worker for worker in pool}
        while busy:
            for connection in [found for found in wait(list(busy)) if isinstance(found, Connection)]:
                worker = busy[connection]
                results = worker.results()
                if results:
                    yield from results
                elif waiting:
                    worker.submit(waiting.pop())
                else:
                    del busy[connection]
    finally:
        for worker in pool:
            worker.kill()


@dataclass(frozen=True)
class _OneResult(Generic[Task, Result]):
    """Makes a function with one result into one with a series of results."""

    prepare: Callable[[], Callable[[Task], Result]]

    def __call__(self) -> Callable[[Task], tuple[Result]]:
        work = self.prepare()
        return lambda task: (work(task),)


class _Worker(Generic[Task, Result]):
    """Process that runs one task after another.

    Attributes:
        connection: readable when the task has a result or is done, or the process is dead.
    """

    def __init__(self, prepare: Callable[[], Callable[[Task], Iterable[Result]]]) -> None:
        context = get_context("spawn")  # a fork would copy the threads and locks of the caller
        self.connection, theirs = context.Pipe()
        self._process: BaseProcess = context.Process(target=_serve, args=(theirs, prepare), daemon=True)
        start_process(self._process)
        theirs.close()
        self._task: Task | None = None

    def submit(self, task: Task) -> None:
        self._task = task
        try:
            self.connection.send(task)
        except BrokenPipeError:
            self._raise_death()

    def results(self) -> Sequence[Result]:
        """Returns the next result of the task; none if the task is done."""
        try:
            message, result = self.connection.recv()
        except (EOFError, ConnectionResetError):
            self._raise_death()
        if message == _FAILED:
            if isinstance(result, OSError | EndpointError):
                raise result
            raise ProcessError(f"{self._task}: {result}")
        found: Result = result
        return (found,) if message == _RESULT else ()

    def kill(self) -> None:
        self._process.kill()
        self._process.join()
        self.connection.close()

    def _raise_death(self) -> None:
        self._process.join()
        raise ProcessError(f"{self._task}: the worker process died with code {self._process.exitcode}")


_RESULT: Final = "result"
_DONE: Final = "done"
_FAILED: Final = "failed"


def _serve(connection: Connection, prepare: Callable[[], Callable[[Any], Iterable[Any]]]) -> None:
    """Runs the tasks of a connection until it is closed; the main function of a worker process."""
    exit_with_parent()
    work: Callable[[Any], Iterable[Any]] | None = None
    while True:
        try:
            task = connection.recv()
        except (EOFError, ConnectionResetError):
            return
        try:
            work = work or prepare()
            for result in work(task):
                connection.send((_RESULT, result))
            connection.send((_DONE, None))
        except EndpointError as error:
            connection.send((_FAILED, error))
        except Exception as error:  # any error is reported to the caller
            connection.send((_FAILED, _portable(error)))


def _portable(error: Exception) -> str | OSError:
    """Returns an error in a form that travels through a pipe: one of the files as it is, others as text."""
    if isinstance(error, OSError) and error.filename is not None:
        return OSError(error.errno, error.strerror, str(error.filename))
    where = traceback.extract_tb(error.__traceback__)[-1]
    place = f"{os.path.basename(where.filename)}, line {where.lineno}"
    return f"{type(error).__name__}: {error} ({place})"


# --- One process ------------------------------------------------------------------------------------------------------


def start_process(process: BaseProcess) -> None:
    """Starts a worker process, which Ctrl-C does not reach; its function must begin with `exit_with_parent`."""
    if os.name == "posix":
        resource_tracker.ensure_running()  # its start would unblock the signals
    with starting_process():
        process.start()


def exit_with_parent() -> None:
    """Ends this worker process when its parent ends, and ignores Ctrl-C, which the parent handles."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
