"""A signal ends a block also where Python drops the exception of its handler."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

PROGRAM = """
    import signal, sys, time, weakref
    from dorothie_gym._startup import exit_at_once
    from dorothie_gym.support.interruption import Terminated, exit_code, raising_interrupts, starting_process

    signal.signal(signal.SIGTERM, exit_at_once)

    class Thing:
        pass

    class Deleted:
        def __del__(self):
            {delete}

    def callback(reference):
        {callback}

    try:
        with raising_interrupts():
            with starting_process():  # from now on an interrupt raises during imports, too
                pass
            thing = Thing()
            reference = weakref.ref(thing, callback)
            del thing
            deleted = Deleted()
            del deleted
            print("goes on", flush=True)
            for _ in range(500):
                time.sleep(0.01)
            print("was not interrupted")
    except Terminated:
        print("ended")
        sys.exit(exit_code())
"""


@pytest.mark.parametrize("where", ["callback", "delete"])
def test_a_signal_whose_exception_is_dropped_ends_the_block(where: str) -> None:
    places = {"callback": "pass", "delete": "pass", where: "signal.raise_signal(signal.SIGTERM)"}
    done = run(PROGRAM.format(**places))
    assert done.stdout.split("\n")[:2] == ["goes on", "ended"]
    assert (done.returncode, done.stderr) == (128 + 15, "")


def test_other_dropped_exceptions_are_reported() -> None:
    places = {"callback": "raise ValueError('of the callback')", "delete": "signal.raise_signal(signal.SIGTERM)"}
    done = run(PROGRAM.format(**places))
    assert "ValueError: of the callback" in done.stderr
    assert "Terminated" not in done.stderr
    assert done.returncode == 128 + 15


def run(program: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, timeout=60, check=False
    )


def test_an_interrupted_process_ends_before_its_modules_are_taken_apart() -> None:
    done = run("""
        import atexit, os, sys
        from dorothie_gym.support.interruption import end_process

        class Library:
            def __del__(self):
                os.abort()  # as C code does that was cut off and frees its memory again

        library = Library()
        atexit.register(print, "exit function")
        print("buffered")
        end_process(130)
    """)
    assert (done.returncode, done.stdout, done.stderr) == (130, "buffered\nexit function\n", "")
