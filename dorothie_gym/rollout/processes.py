"""Work shared out among processes that end when the one that started them does, however it dies."""

from __future__ import annotations

import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

from dorothie_gym.errors import ProcessError

Task = TypeVar("Task")
Result = TypeVar("Result")


def share_out(
    prepare: Callable[[], Callable[[Task], Result]], tasks: Iterable[Task], *, workers: int
) -> Iterator[Result]:
    """Does tasks in so many processes, and yields what comes of them as it comes.

    Tasks and results travel through pipes. When the caller stops before the end, the processes are killed.

    Args:
        prepare: called once in each process, returns what does a task there; an object that can be sent to a process.
        tasks: what is to be done.
        workers: how many processes; 1 does the work in this one.

    Raises:
        ProcessError: a task failed in another process, or its process died.
    """
    waiting = list(reversed(list(tasks)))
    if workers == 1:
        work = prepare()
        while waiting:
            yield work(waiting.pop())
        return
    crew = [_Worker(prepare) for _ in range(min(workers, len(waiting)))]
    try:
        for worker in crew:
            worker.give(waiting.pop())
        busy: dict[Any, _Worker[Task, Result]] = {worker.connection: worker for worker in crew}
        while busy:
            for connection in wait(list(busy)):
                worker = busy[connection]
                result = worker.take()
                if waiting:
                    worker.give(waiting.pop())
                else:
                    del busy[connection]
                yield result
    finally:
        for worker in crew:
            worker.end()


class _Worker(Generic[Task, Result]):
    """A process that does one task after the other.

    Attributes:
        connection: has something to read when the task is done, or the process dead.
    """

    def __init__(self, prepare: Callable[[], Callable[[Task], Result]]) -> None:
        context = get_context("spawn")  # a fork would copy whatever threads and locks the caller has
        self.connection, theirs = context.Pipe()
        self._process: BaseProcess = context.Process(target=_serve, args=(theirs, prepare), daemon=True)
        self._process.start()
        theirs.close()
        self._task: Task | None = None

    def give(self, task: Task) -> None:
        self._task = task
        try:
            self.connection.send(task)
        except BrokenPipeError:
            self._fail()

    def take(self) -> Result:
        try:
            done, result = self.connection.recv()
        except (EOFError, ConnectionResetError):
            self._fail()
        if not done:
            raise ProcessError(f"{self._task}: {result}")
        found: Result = result
        return found

    def end(self) -> None:
        self._process.kill()
        self._process.join()
        self.connection.close()

    def _fail(self) -> None:
        self._process.join()
        raise ProcessError(f"{self._task}: the process that did it died with code {self._process.exitcode}")


def _serve(connection: Connection, prepare: Callable[[], Callable[[Any], Any]]) -> None:
    """What a process does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the caller decides what it means
    threading.Thread(target=_die_with_parent, daemon=True).start()
    work: Callable[[Any], Any] | None = None
    while True:
        try:
            task = connection.recv()
        except EOFError:
            return
        try:
            work = work or prepare()
            answer = True, work(task)
        except Exception as error:  # whatever it is, the caller is told
            where = traceback.extract_tb(error.__traceback__)[-1]
            answer = False, f"{type(error).__name__}: {error} ({os.path.basename(where.filename)}, line {where.lineno})"
        connection.send(answer)


def _die_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
