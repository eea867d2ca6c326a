"""Ctrl-C (SIGINT) and SIGTERM in a command of the command line and around the start of its worker processes.

Both signals raise `KeyboardInterrupt` in the main thread of a command. During imports before the first worker process,
the program exits at once instead: nothing needs to be saved then, and an exception inside an import may be swallowed by
the imported library or end in its traceback. `_startup` handles signals before the command.

Python drops an exception that is raised while it runs a callback of a weak reference, a `__del__` or a callback of
ctypes: it is given to `sys.unraisablehook` and the program goes on. A signal that arrives there is delivered again.
"""

from __future__ import annotations

import _thread
import atexit
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Final, NoReturn

from dorothie_gym._startup import exit_at_once

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

_AGAIN_SECONDS: Final = 0.01  # the callback has usually ended by then; if not, the signal is delivered once more
_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)


class Terminated(KeyboardInterrupt):
    """SIGTERM, which ends a command as Ctrl-C does."""


class _State:
    """State of this process.

    Attributes:
        processes: whether it has started a process, which must be ended.
        received: the last signal.
    """

    processes = False
    received: int = signal.SIGINT


@contextmanager
def raising_interrupts() -> Iterator[None]:
    """Lets both signals raise `KeyboardInterrupt` inside the block, if `_startup` handles them so far.

    After the block they end the program without a message, as it has printed its own.
    """
    handled = [number for number in _SIGNALS if signal.getsignal(number) is exit_at_once]
    for number in handled:
        signal.signal(number, _interrupt)
    dropped = sys.unraisablehook
    if handled:
        sys.unraisablehook = _deliver_again
    try:
        yield
    finally:
        for number in handled:
            signal.signal(number, signal.SIG_DFL)
        sys.unraisablehook = dropped


def exit_code() -> int:
    """Returns the exit code after the last signal, by the convention of shells: 130 for SIGINT, 143 for SIGTERM."""
    return 128 + _State.received


def end_process(code: int) -> NoReturn:
    """Ends an interrupted process with an exit code, after its exit functions, without taking its modules apart.

    A library whose import or first call a signal has cut off may not survive that: torch 2.13 was seen to free memory
    twice and to abort, which replaced the exit code.
    """
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # nobody reads a closed pipe
            stream.flush()
    os._exit(code)


def message() -> str:
    """Returns a line on the last signal, for commands without a message of their own."""
    return "Terminated." if _State.received == signal.SIGTERM else "Interrupted."


def _interrupt(number: int, frame: FrameType | None) -> None:
    _State.received = number
    if not _State.processes and _in_import(frame):
        exit_at_once(number, frame)
    raise Terminated if number == signal.SIGTERM else KeyboardInterrupt


def _deliver_again(dropped: UnraisableHookArgs) -> None:
    """Delivers a signal again whose exception Python has dropped; other dropped exceptions are reported as usual.

    A signal that this thread raised would be handled inside this function, where its exception is dropped again.
    """
    if issubclass(dropped.exc_type, KeyboardInterrupt):
        again = threading.Timer(_AGAIN_SECONDS, _thread.interrupt_main, (_State.received,))
        again.daemon = True
        again.start()
    else:
        sys.__unraisablehook__(dropped)


def _in_import(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


# --- Processes --------------------------------------------------------------------------------------------------------


@contextmanager
def starting_process() -> Iterator[None]:
    """Protects the start of a process inside the block from both signals.

    The new process inherits the blocked SIGINT: Ctrl-C, which reaches the whole process group, is handled by this
    process as soon as the new one starts. Signals to this process are delivered when the block is left;
    an interrupted start would leave a process without its data.
    """
    _State.processes = True
    held: list[int] = []
    before = {}
    if threading.current_thread() is threading.main_thread():
        handlers = {number: signal.getsignal(number) for number in _SIGNALS}
        before = {number: handler for number, handler in handlers.items() if callable(handler)}
    for number in before:
        signal.signal(number, lambda received, frame: held.append(received))
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if hasattr(signal, "pthread_sigmask") else None
    try:
        yield
    finally:
        if blocked is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        for number, handler in before.items():
            signal.signal(number, handler)
        if held:
            signal.raise_signal(held[0])
