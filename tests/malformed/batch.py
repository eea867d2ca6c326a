"""Batch of mutated files in a process of its own: `python -m tests.malformed.batch KINDS SEED FIRST COUNT`.

A line of JSON is printed before each file, so that the parent knows which one was read when the process hangs.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import sys
import tempfile
import traceback
import warnings
from pathlib import Path
from random import Random

from tests.malformed.memory import peak_memory

MEMORY = 1_500 * 2**20
"""Largest resident memory of the process [bytes]."""

ADDRESSES = 12 * 2**30
"""Limit of the address space [bytes]: absurd requests fail at once."""


def one(kind: str, seed: int, number: int, originals: Path) -> str | None:
    """Reads one mutation; returns the fault, or None."""
    from dorothie_gym.errors import DorothieGymError
    from tests.malformed.mutation import mutate_folder
    from tests.malformed.subjects import SUBJECTS, check_message

    subject = SUBJECTS[kind]
    with tempfile.TemporaryDirectory(prefix="malformed-") as root:
        folder = Path(root) / "given"
        shutil.copytree(originals / kind, folder)
        hidden = [folder / path.name for path in folder.iterdir() if path.name.startswith(".")]
        for path in hidden:
            path.rename(Path(root) / path.name)
        mutate_folder(folder, Random(f"{kind} {seed} {number}"))
        for path in hidden:
            (Path(root) / path.name).rename(path)
        try:
            subject.read(folder)
        except DorothieGymError as error:
            try:
                check_message(error)
            except AssertionError as fault:
                return str(fault)
        except OSError as error:
            if error.filename is None:
                return traceback.format_exc()
        except BaseException:
            return traceback.format_exc()
    used = peak_memory()
    return f"the process takes {used >> 20} MiB" if used > MEMORY else None


def main(kinds: list[str], seed: int, first: int, count: int) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    warnings.simplefilter("ignore")
    os.environ["DOROTHIE_GYM_CACHE"] = ""
    from tests.malformed.subjects import SUBJECTS

    with tempfile.TemporaryDirectory(prefix="malformed-") as root:
        for kind in kinds:
            (Path(root) / kind).mkdir()
            SUBJECTS[kind].make(Path(root) / kind)
            SUBJECTS[kind].read(Path(shutil.copytree(Path(root) / kind, Path(root) / f"{kind}-sound")))
        for number in range(first, first + count):
            for kind in kinds:
                print(json.dumps({"kind": kind, "number": number}), flush=True)
                if fault := one(kind, seed, number, Path(root)):
                    print(json.dumps({"kind": kind, "number": number, "fault": fault}), flush=True)
    print(json.dumps({"end": True}), flush=True)


if __name__ == "__main__":
    main(sys.argv[1].split(","), *map(int, sys.argv[2:5]))
