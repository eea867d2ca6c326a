"""Decisions per second and processor time of whole sessions with talk, by part, against builds of other revisions."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final

from benchmarks.timing import BenchmarkProcessError, Figures, Progress, Timing, ignore_progress, machine, rounded
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import Role
from dorothie_gym.policies import make_policy
from dorothie_gym.support.interruption import starting_process

ROOT: Final = Path(__file__).parents[1]
"""Root of the checkout."""

HERE: Final = "this build"

TOWNS: Final = ("midtown", "brookside")

CO_WIZARDS: Final = ("scripted", "pretrained:co-wizard")
"""Policies of the Co-Wizard that are measured."""


def measure(
    towns: Sequence[str] = TOWNS,
    *,
    co_wizards: Sequence[str] = CO_WIZARDS,
    sessions: int = 4,
    seed: int = 5000,
    max_seconds: float = 900.0,
    record: bool = False,
    at_once: int = 1,
    against: str | None = None,
    repeats: int = 3,
    progress: Progress = ignore_progress,
) -> Figures:
    """Plays the same seeds in new processes, alternately with this build and another, in processor time.

    Sessions of two builds may differ; the rates are those of all their decisions. The parts are measured in a process
    of its own, since measuring takes time.

    Args:
        towns: names or files.
        co_wizards: policies of the Co-Wizard; the other two roles are scripted.
        sessions: number of sessions in each town.
        seed: seed of the first session.
        max_seconds: time limit of a session [s].
        record: whether the sessions are recorded.
        at_once: number of sessions of a town that are played at the same time, by builds that can.
        against: revision of the checkout to be measured as well; None for none.
        repeats: number of processes of each build.
        progress: callback for the progress.

    Raises:
        TownError: there is no such town, or its file is invalid.
        ValueError: there is no such policy.
        BenchmarkProcessError: there is no such revision, or a process ended early.
    """
    for town in towns:
        load_town(town)  # before the first process
    for name in co_wizards:
        make_policy(name, Role.CO_WIZARD)
    settings = {
        "towns": list(towns),
        "seeds": list(range(seed, seed + sessions)),
        "record": record,
        "max_seconds": max_seconds,
        "at_once": at_once,
    }
    with builds(against) as folders:
        rows = [
            _row(folders, {**settings, "co_wizard": name}, repeats, partial(_scaled, progress, number, len(co_wizards)))
            for number, name in enumerate(co_wizards)
        ]
    return {
        "towns": list(towns),
        "sessions": sessions * len(towns),
        "seed": seed,
        "recorded": record,
        "at_once": at_once,
        "against": against,
        "rows": rows,
        "repeats": repeats,
        "machine": machine(),
    }


def _scaled(progress: Progress, number: int, count: int, part: str, share: float) -> None:
    """Reports the progress of one of several measurements."""
    progress(part, (number + share) / count)


def _row(folders: Mapping[str, Path], settings: Mapping[str, Any], repeats: int, progress: Progress) -> Figures:
    """Returns the figures of one policy of the Co-Wizard."""
    name = settings["co_wizard"]
    played: dict[str, list[dict[str, Any]]] = {build: [] for build in folders}
    for turn in range(repeats):
        for build, folder in folders.items():
            progress(f"{name}, {build}", turn / (repeats + 1))
            played[build].append(run(folder, {**settings, "parts": False}))
    found: Figures = {"co_wizard": name}
    for build, folder in folders.items():
        progress(f"{name}, parts of {build}", repeats / (repeats + 1))
        parts = run(folder, {**settings, "parts": True})
        found["ours" if build == HERE else "theirs"] = _figures(played[build], parts)
    if "theirs" not in found:
        return {**found, "theirs": None, "ratio": None}
    ratio = found["ours"]["decisions_per_second"] / found["theirs"]["decisions_per_second"]
    return {**found, "ratio": rounded(ratio)}


def _figures(played: Sequence[Mapping[str, Any]], measured: Mapping[str, Any]) -> Figures:
    timing = Timing(tuple(each["seconds"] / each["decisions"] for each in played))
    hours = played[0]["simulated_seconds"] / 3600.0
    parts = {part: 1000.0 * seconds / measured["decisions"] for part, seconds in measured["parts"].items()}
    return {
        "decisions": played[0]["decisions"],
        "decisions_per_second": rounded(timing.rate),
        "best": rounded(timing.best),
        "spread": timing.spread,
        "megabytes_per_session": rounded(max(each["megabytes"] for each in played)),
        "seconds_per_hour": rounded(timing.median * played[0]["decisions"] / hours),
        "milliseconds_by_part": {part: rounded(parts[part]) for part in sorted(parts, key=lambda each: -parts[each])},
        "missing_parts": measured["missing"],
    }


@contextmanager
def builds(against: str | None) -> Iterator[dict[str, Path]]:
    """Yields the folders of this build and of another revision, by name; the latter is removed at the end.

    Raises:
        BenchmarkProcessError: there is no such revision in this checkout.
    """
    if against is None:
        yield {HERE: ROOT}
        return
    with tempfile.TemporaryDirectory() as folder:
        archive = Path(folder, "package.tar")
        _output(["git", "-C", str(ROOT), "archive", "--output", str(archive), against, "dorothie_gym"])
        _output(["tar", "-xf", str(archive), "-C", folder])
        yield {HERE: ROOT, against: Path(folder)}


def run(folder: Path, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the result of `session_costs.costs` in a new process with the build of a folder.

    Raises:
        BenchmarkProcessError: the process ended early.
    """
    script = Path(__file__).with_name("session_costs.py")
    found: dict[str, Any] = json.loads(_output([sys.executable, "-P", str(script), json.dumps(settings)], folder))
    return found


def _output(command: Sequence[str], build: Path | None = None) -> str:
    environment = {**os.environ, "PYTHONPATH": "" if build is None else str(build)}
    with starting_process():
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=build, env=environment
        )
    try:
        output, noise = process.communicate()
    finally:
        process.kill()  # after Ctrl-C
    if process.returncode:
        last = noise.strip().splitlines()[-1:] or ["no message"]
        raise BenchmarkProcessError(f"{command[0]} ended with code {process.returncode}: {last[0]}")
    return output
