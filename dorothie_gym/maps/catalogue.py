"""The towns that are shipped, and files of one's own."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dorothie_gym.errors import TownError
from dorothie_gym.maps.cache import through_cache
from dorothie_gym.maps.model import LaneLink, SignalKind
from dorothie_gym.maps.town import Town

SEEN_TOWNS: tuple[str, ...] = ("midtown", "millbrook", "northgate")
"""Towns that sessions to train on are driven in (the paper's folds: CARLA's Town01, Town03 and Town05)."""

UNSEEN_TOWNS: tuple[str, ...] = ("brookside",)
"""Towns that sessions of the unseen fold are driven in (the paper's: CARLA's Town02)."""

_SUFFIXES = (".xodr", ".yaml", ".yml")
_FOLDER = files("dorothie_gym.maps") / "data"


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
    the user's cache folder (see `dorothie_gym.maps.cache`). Towns are not to be modified.

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
        from dorothie_gym.maps.opendrive import read_opendrive

        return read_opendrive(path)
    from dorothie_gym.maps.yaml import read_yaml_town

    return read_yaml_town(path)


# --- A town in figures -----------------------------------------------------------------------------------------------


def describe(town: Town) -> dict[str, Any]:
    """What a town has, in numbers and names that go into JSON.

    Returns:
        name: of the town;
        lanes, links: counts, connectors included, lane changes excluded from the links;
        components: sizes of the strongly connected components of lanes by links alone, largest first;
        components_with_lane_changes: the same when lane changes count;
        kilometres: of all lanes, to 10 m;
        junctions: count;
        streets: their names;
        signals: count of traffic lights;
        crosswalks, sites: counts.
    """
    onward = [link for link in town.links if not link.type.is_lane_change]
    return {
        "name": town.name,
        "lanes": len(town.lanes),
        "links": len(onward),
        "components": _component_sizes(len(town.lanes), onward),
        "components_with_lane_changes": _component_sizes(len(town.lanes), town.links),
        "kilometres": round(town.kilometres, 2),
        "junctions": len(town.junctions),
        "streets": [street.name for street in town.streets],
        "signals": sum(signal.kind is SignalKind.TRAFFIC_LIGHT for signal in town.signals),
        "crosswalks": len(town.crosswalks),
        "sites": len(town.sites),
    }


def _component_sizes(lanes: int, links: Iterable[LaneLink]) -> list[int]:
    """Sizes of the strongly connected components, largest first."""
    if lanes == 0:
        return []
    pairs = np.array([(link.source, link.target) for link in links], dtype=np.intp).reshape(-1, 2)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(lanes, lanes)).tocsr()
    _, labels = connected_components(graph, directed=True, connection="strong")
    return sorted((int(size) for size in np.bincount(labels)), reverse=True)
