"""Ctrl-C (SIGINT) and SIGTERM while the command line is imported: a line and the exit code instead of a traceback.

The package imports this module first. It imports only modules that every interpreter has loaded: `signal` itself takes
ten milliseconds, in which Ctrl-C would print a traceback.
"""

import _signal  # type: ignore[import-not-found, unused-ignore]  # the C part of `signal`, without stubs
import os
import sys

_MODULES = ("dorothie_gym", "dorothie_gym.cli", "dorothie_gym.__main__", "dorothie_gym.cli.__main__")


def is_command_line() -> bool:
    """Returns whether this process is the script `dorothie-gym` or `python -m dorothie_gym`, not one of its workers."""
    if "--multiprocessing-fork" in sys.orig_argv:
        return False
    name = sys.argv[0] if sys.argv else ""
    if name == "-m":  # the package is imported as a parent of its module
        after = sys.orig_argv[sys.orig_argv.index("-m") + 1 :] if "-m" in sys.orig_argv else []
        return bool(after) and after[0] in _MODULES
    return os.path.splitext(os.path.basename(name))[0] == "dorothie-gym"


def exit_on_signals() -> None:
    """Lets both signals end the process at once; a signal that the caller of the process ignores stays ignored."""
    for number in (_signal.SIGINT, _signal.SIGTERM):
        if _signal.getsignal(number) in (_signal.SIG_DFL, _signal.default_int_handler):
            _signal.signal(number, exit_at_once)


def exit_at_once(number: int, frame: object) -> None:
    """Prints a line on standard error and ends the process; the handler of both signals before a command begins."""
    os.write(2, b"Terminated.\n" if number == _signal.SIGTERM else b"Interrupted.\n")
    os._exit(128 + number)


if is_command_line():
    exit_on_signals()
