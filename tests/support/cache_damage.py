"""Damage of files in a cache folder: what a failing disk, a full one, or a careless copy leaves."""

from __future__ import annotations

import os
import random
import shutil
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final

Damage = Callable[[Path, random.Random], None]


def _flip(path: Path, drawn: random.Random) -> None:
    data = bytearray(path.read_bytes())
    for at in drawn.choices(range(len(data)), k=3) if data else ():
        data[at] ^= 1 << drawn.randrange(8)
    path.write_bytes(data)


def _cut(path: Path, drawn: random.Random) -> None:
    data = path.read_bytes()
    path.write_bytes(data[: drawn.randrange(max(len(data), 1))])


def _empty(path: Path, drawn: random.Random) -> None:
    path.write_bytes(b"")


def _fill(path: Path, drawn: random.Random) -> None:
    path.write_bytes(drawn.randbytes(drawn.choice([1, 63, 64, 65, 1000, 100_000])))


def _zero(path: Path, drawn: random.Random) -> None:
    """Writes a block of zeros, which a power failure leaves on some file systems."""
    data = bytearray(path.read_bytes())
    at = drawn.randrange(max(len(data), 1))
    end = min(at + 4096, len(data))
    data[at:end] = bytes(end - at)
    path.write_bytes(data)


def _append(path: Path, drawn: random.Random) -> None:
    path.write_bytes(path.read_bytes() + drawn.randbytes(drawn.randrange(1, 200)))


def _turn_into_folder(path: Path, drawn: random.Random) -> None:
    path.unlink()
    path.mkdir()
    (path / "file").touch()


def _turn_into_pipe(path: Path, drawn: random.Random) -> None:
    path.unlink()
    os.mkfifo(path)


def _remove(path: Path, drawn: random.Random) -> None:
    path.unlink()


def _replace(path: Path, drawn: random.Random) -> None:
    """Replaces the file by another one of its folder, which is whole but lies under a wrong name."""
    others = sorted(each for each in path.parent.iterdir() if each.is_file() and each.name != path.name)
    if others:
        shutil.copyfile(drawn.choice(others), path)


DAMAGES: Final[Mapping[str, Damage]] = MappingProxyType(
    {
        "flipped bits": _flip, "cut": _cut, "empty": _empty, "noise": _fill, "zeros": _zero, "longer": _append,
        "folder": _turn_into_folder, "pipe": _turn_into_pipe, "missing": _remove, "another entry": _replace,
    }
)  # fmt: skip
"""Kinds of damage, by name."""


def files_in(folder: Path, without: Collection[str] = ()) -> Sequence[Path]:
    """Returns all files in a folder and below, sorted, without those in some of its folders."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return sorted(path for path in found if path.relative_to(folder).parts[0] not in without)


def damage_some(folder: Path, seed: int, without: Collection[str] = ()) -> Sequence[str]:
    """Damages one to eight files of a folder, which a seed chooses; returns what was done. Arguments as `files_in`."""
    drawn = random.Random(seed)
    files = files_in(folder, without)
    done = []
    for path in drawn.sample(files, min(len(files), drawn.choice([1, 1, 2, 3, 8]))):
        kind = drawn.choice(sorted(DAMAGES))
        DAMAGES[kind](path, drawn)
        done.append(f"{path.relative_to(folder)}: {kind}")
    return done
