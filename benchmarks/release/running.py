"""Running of the steps of a release: each in a folder of its build, so that an interrupted release resumes."""

from __future__ import annotations

import datetime
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.release.figures import Measurement
from benchmarks.release.steps import Step
from benchmarks.timing import machine
from dorothie_gym.errors import ProcessError
from dorothie_gym.support.files import make_folder, write_atomically

ROOT: Final = Path(__file__).parents[2]
MEASURED: Final = "dorothie_gym", "benchmarks", "examples"
"""Folders of the checkout that figures depend on."""


@dataclass(frozen=True, kw_only=True)
class Build:
    """State of the checkout.

    Attributes:
        commit: abbreviated hash of the commit.
        package: hash of the folder of the package in it.
        changes: files of `MEASURED` that differ from the commit.
    """

    commit: str
    package: str
    changes: tuple[str, ...]

    @classmethod
    def of_checkout(cls) -> Build:
        """Returns the state of this checkout; raises `ProcessError` if it is none."""
        changed = _git("status", "--porcelain", "--", *MEASURED).splitlines()
        return cls(
            commit=_git("rev-parse", "--short=8", "HEAD"),
            package=_git("rev-parse", "--short=12", "HEAD:dorothie_gym"),
            changes=tuple(line[3:] for line in changed),
        )


def _git(*arguments: str) -> str:
    try:
        done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise ProcessError(f"git {arguments[0]} has failed in {ROOT}; figures are measured in a checkout") from error
    return done.stdout.rstrip("\n")


def measure(step: Step, build: Build, work: Path, on_command: Callable[[str], None]) -> Measurement:
    """Runs the commands of a step that have not been run for this build, and returns its figures.

    Args:
        step: the step.
        build: state of the checkout.
        work: folder for the results of all steps and builds.
        on_command: is called with each command before it is run.

    Raises:
        ProcessError: a command has failed.
    """
    folder = work.absolute() / build.package / step.name
    make_folder(folder, parents=True)
    for number, command in enumerate(step.commands):
        output = folder / f"{number}.json"
        if not output.is_file():
            on_command(command)
            write_atomically(output, _run(command, folder))
    measured = Measurement(
        commands=step.commands,
        commit=build.commit,
        build=build.package,
        date=datetime.date.today().isoformat(),
        machine=machine(),
        figures=step.read(folder),
    )
    return measured


def _run(command: str, folder: Path) -> str:
    """Runs a command in a folder, with the package of this checkout; returns what it wrote on standard output."""
    words = [sys.executable if word == "python" else word for word in shlex.split(command)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(words, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode < 0 or done.returncode > 128:
        raise KeyboardInterrupt  # by a signal, as the whole group receives Ctrl-C
    if done.returncode != 0:
        raise ProcessError(f"{command}: exit code {done.returncode}; it was run in {folder}")
    if "--json" in words:
        json.loads(done.stdout)  # a command that prints something else is a fault of the step
    return done.stdout


def outdated(measurements: dict[str, Measurement], steps: Sequence[str], build: Build) -> list[str]:
    """Returns the steps that were not measured with the package of this build."""
    return [name for name in steps if name not in measurements or measurements[name].build != build.package]
