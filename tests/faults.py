"""Sweep of faults over the servers for people: console, studies, and annotation.

`python -m tests.faults --times 300 --seed 7` lets writes fail, fills the disk, and kills processes, at moments that
follow from the seed and the speed of the machine; prints counts as JSON. It fails where something that was acknowledged
is lost, something that was erased is left, or a restart does not work.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from dorothie_gym.lab.studies.database import StorageError
from dorothie_gym.lab.studies.erasure import erase, finish_erasures
from dorothie_gym.lab.studies.records import StudyRecords
from tests.lab.annotation import killing as annotation
from tests.lab.console import killing as console
from tests.lab.studies import killing as studies
from tests.lab.studies.faults import Faults, die, fail, prepare, remains, striking

SHARES = {"erasure": 0.3, "annotation": 0.25, "console": 0.15, "studies": 0.3}
"""Shares of the faults."""

WRITES = 30
"""Writes of an erasure, about."""


def spoil_erasures(folder: Path, *, times: int, seed: int) -> dict[str, int]:
    """Erases a person in copies of a study while a write fails, all writes fail from then on, or the process dies.

    Args:
        folder: an empty folder.
        times: number of faults.
        seed: seed of the writes.

    Returns:
        Number of faults of each kind.
    """
    drawn, name, counts = random.Random(seed), prepare(folder / "whole"), {"failed": 0, "broken": 0, "killed": 0}
    for number in range(times):
        at, kind = drawn.randint(1, WRITES), drawn.choice(list(counts))
        copy = folder / f"copy-{number}"
        shutil.copytree(folder / "whole", copy)
        if kind == "killed":
            _erase_in_a_child(copy, name, at)
        else:
            strikes: Callable[[int], bool] = at.__eq__ if kind == "failed" else at.__le__
            refused = contextlib.suppress(StorageError)  # nothing is acknowledged then
            with striking(Faults(fail, strikes)), contextlib.closing(StudyRecords(copy)) as records, refused:
                erase(records, name)
        with contextlib.closing(StudyRecords(copy)) as records:  # the next start
            assert finish_erasures(records) == []
            if records.participant(name) is not None:
                assert erase(records, name)[1] == []
        assert remains(copy, name) == [], (kind, at)
        shutil.rmtree(copy)
        counts[kind] += 1
    return counts


def _erase_in_a_child(copy: Path, name: str, at: int) -> None:
    child = os.fork()
    if child == 0:
        try:
            with striking(Faults(die, at.__eq__)):
                erase(StudyRecords(copy), name)
        finally:
            os._exit(0)
    os.waitpid(child, 0)


def sweep(folder: Path, *, times: int, seed: int) -> dict[str, dict[str, int]]:
    """Injects faults into all servers.

    Args:
        folder: an empty folder.
        times: number of faults, at least.
        seed: seed of the faults.

    Returns:
        For each server, numbers of faults and of what was acknowledged and kept.
    """
    parts = {name: round(share * times) for name, share in SHARES.items()}
    for name in parts:
        (folder / name).mkdir()
    found = {"erasure": spoil_erasures(folder / "erasure", times=parts["erasure"], seed=seed)}
    for name, module in (("annotation", annotation), ("console", console), ("studies", studies)):
        found[name], life = {}, 0
        while count_faults(found[name]) < parts[name]:
            part = folder / name / str(life)
            part.mkdir()
            more = module.kill_again_and_again(part, times=_lives(parts[name]), seed=1000 * seed + life)
            found[name] = {key: found[name].get(key, 0) + count for key, count in more.items()}
            life += 1
    return found


def _lives(faults: int) -> int:
    """Returns the number of kills after which a server is looked at as a whole; the disk is full in between."""
    return max(1, min(6, faults // 2))


def count_faults(found: dict[str, int]) -> int:
    """Returns the number of faults that a server has met."""
    return sum(found.get(kind, 0) for kind in ("failed", "broken", "killed", "kills", "full_disks"))


def main() -> None:
    """Sweeps as the command line asks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=300, help="number of faults, at least")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = sweep(Path(folder), times=asked.times, seed=asked.seed)
    print(json.dumps({"faults": sum(map(count_faults, found.values())), **found}))


if __name__ == "__main__":
    main()
