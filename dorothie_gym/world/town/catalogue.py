"""The towns that are shipped, and files of one's own."""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import as_file, files
from pathlib import Path

from dorothie_gym.world.town.errors import TownError
from dorothie_gym.world.town.model import Town
from dorothie_gym.world.town.store import through_cache

SEEN_TOWNS: tuple[str, ...] = ("midtown", "millbrook", "northgate")
"""Towns that sessions to train on are driven in (the paper's folds: CARLA's Town01, Town03 and Town05)."""

UNSEEN_TOWNS: tuple[str, ...] = ("brookside",)
"""Towns that sessions of the unseen fold are driven in (the paper's: CARLA's Town02)."""

_SUFFIXES = (".xodr", ".yaml", ".yml")
_FOLDER = files("dorothie_gym.world.town") / "data"


def town_names() -> tuple[str, ...]:
    """Names of the towns that are shipped, in alphabetical order."""
    return tuple(
        sorted(entry.name.removesuffix(".yaml") for entry in _FOLDER.iterdir() if entry.name.endswith(".yaml"))
    )


def fold_of(name: str) -> str | None:
    """The fold that a town belongs to: "seen", "unseen", or None for a town of one's own."""
    if name in SEEN_TOWNS:
        return "seen"
    return "unseen" if name in UNSEEN_TOWNS else None


def load_town(name_or_path: str | Path) -> Town:
    """The town of that name, or the one in that file (`.xodr` for OpenDRIVE, `.yaml` for the town language).

    A town that was read before is given again as long as its file has not changed, also in later runs: it is kept in
    the user's cache folder (see `dorothie_gym.world.town.store`). Towns are not to be modified.

    Raises:
        TownError: there is no such town or file, or the file is at fault.
    """
    if str(name_or_path) in town_names():
        with as_file(_FOLDER / f"{name_or_path}.yaml") as path:
            return _load(path)
    path = Path(name_or_path)
    if path.suffix.lower() not in _SUFFIXES:
        raise TownError(
            str(name_or_path),
            "town",
            f"there is no such town; known towns are {', '.join(town_names())}, and files end in .xodr or .yaml",
        )
    return _load(path)


def _load(path: Path) -> Town:
    try:
        resolved = path.resolve(strict=True)
        stamp = resolved.stat()
    except OSError as error:
        raise TownError(str(path), "file", f"cannot be read ({error.strerror}); check the path") from error
    return _read(resolved, stamp.st_mtime_ns, stamp.st_size)


@lru_cache(maxsize=16)
def _read(path: Path, modified: int, size: int) -> Town:
    """Reads a file once a run; when it was modified and its size are there to tell versions apart."""
    return through_cache(path, _compile)


def _compile(path: Path) -> Town:
    # Each reader is imported when it is needed: lxml and scipy are slow to start.
    if path.suffix.lower() == ".xodr":
        from dorothie_gym.world.town.opendrive import read_opendrive

        return read_opendrive(path)
    from dorothie_gym.world.town.yaml_town import read_yaml_town

    return read_yaml_town(path)
