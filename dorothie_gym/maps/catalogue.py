"""Catalogue of towns: shipped ones by name, others by file, and summary figures of a town."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dorothie_gym.errors import InputFileError, TownError, did_you_mean
from dorothie_gym.maps import generated, opendrive, yaml  # lazy: their parsers are slow to import
from dorothie_gym.maps.cache import through_cache
from dorothie_gym.maps.default_lights import Lights, split_lights, with_default_lights
from dorothie_gym.maps.generated.specification import TownSeries, TownSpecification, is_generated, parse_specification
from dorothie_gym.maps.import_notes import ImportNotes
from dorothie_gym.maps.model import LaneLink, SignalKind
from dorothie_gym.maps.open_street_map import is_street_map
from dorothie_gym.maps.town import Town, check_extent
from dorothie_gym.support.input_files import MAX_OPENDRIVE, check_file

if TYPE_CHECKING:
    from dorothie_gym.maps.import_notes import ImportNote
    from dorothie_gym.support.files import JsonValue

_SUFFIXES = (".xodr", ".yaml", ".yml")
_PLAIN_NAME = re.compile(r"\w{1,60}")
_FOLDER = files("dorothie_gym.maps") / "data"


def town_names() -> tuple[str, ...]:
    """Returns the names of the shipped towns in alphabetical order."""
    return tuple(
        sorted(entry.name.removesuffix(".yaml") for entry in _FOLDER.iterdir() if entry.name.endswith(".yaml"))
    )


def load_town(name_or_path: str | Path, *, lights: str | None = None) -> Town:
    """Loads a town by name, or from a file (`.xodr` for OpenDRIVE, `.yaml` or `.yml` for the town language).

    Names are those of shipped towns, and `generated:SEED` with the options `size`, `style` and `traffic`
    (`dorothie_gym.maps.generated.specification`). A path to an OpenDRIVE file may have the option `lights`, as in
    `Town05.xodr,lights=default`.

    Towns are cached: within a process as objects, between processes as archives in the user's cache folder
    (`dorothie_gym.maps.cache`). An entry is valid until its file changes. Do not modify a town.

    Args:
        name_or_path: name or file.
        lights: "default" gives an OpenDRIVE map without traffic lights some where main roads cross
            (`dorothie_gym.maps.default_lights`), "map" does not. By default as the name states, or "map".

    Raises:
        TownError: no town or file has this name, or the file is invalid; `lights` is for OpenDRIVE files only.
    """
    name_or_path, chosen = _lights_of(name_or_path, lights)
    if is_generated(str(name_or_path)):
        return _generate(parse_specification(str(name_or_path)))[0]
    with _located(name_or_path) as path:
        return _load(path, chosen)


def town_at(source: str | Path | Town | TownSeries, seed: int) -> Town:
    """Returns the town of a session: the one that is given or named, or that of the seed in a series of towns.

    Raises:
        TownError: as `load_town`.
    """
    if isinstance(source, Town):
        return source
    return load_town(source.name(seed) if isinstance(source, TownSeries) else source)


def import_report(name_or_path: str | Path) -> tuple[ImportNote, ...]:
    """Compiles a town again, and returns what was dropped from its file, repaired or assumed, by action and kind.

    Raises:
        TownError: no town or file has this name, or the file is invalid.
    """
    name_or_path, lights = _lights_of(name_or_path, None)
    if is_generated(str(name_or_path)):
        return _generate(parse_specification(str(name_or_path)))[1].sorted()
    with _located(name_or_path) as path:
        _stamp(path)
        town, notes = _import(path)
        if lights is Lights.DEFAULT:
            with_default_lights(town, notes)
        return notes.sorted()


def _lights_of(name_or_path: str | Path, lights: str | None) -> tuple[str | Path, Lights]:
    """Returns a town's name or path without the option for lights, and the source of its lights.

    Raises:
        TownError: there is no such source, or the town is no OpenDRIVE file.
    """
    name = str(name_or_path)
    if lights is not None:
        name = f"{split_lights(name)[0]},lights={lights}"
    found, source = split_lights(name)
    if source is Lights.DEFAULT and not found.lower().endswith(".xodr"):
        is_yaml = Path(found).suffix.lower() in _SUFFIXES
        remedy = "name its junctions under 'lights'" if is_yaml else "give the file of a map (.xodr)"
        raise TownError(found, "lights", f"is for OpenDRIVE maps; {remedy}")
    return (found if found != str(name_or_path) else name_or_path), source


@contextmanager
def _located(name_or_path: str | Path) -> Iterator[Path]:
    """Yields the file of a town, which is a shipped one or a map of the user."""
    if str(name_or_path) in town_names():
        with as_file(_FOLDER / f"{name_or_path}.yaml") as path:
            yield path
        return
    path = Path(name_or_path)
    if path.suffix.lower() not in _SUFFIXES:
        if is_street_map(path):
            reason = (
                f"is a street map, not a town; make one: dorothie-gym towns {path} --out {path.name.split('.')[0]}.xodr"
            )
            raise TownError(str(name_or_path), "town", reason)
        raise TownError(
            str(name_or_path),
            "town",
            f"there is no such town; {did_you_mean(str(name_or_path), town_names())}"
            f"known towns are {', '.join(town_names())} and generated:SEED, and files end in .xodr or .yaml",
        )
    yield path


def find_town(name: str, maps: Path | None) -> Town | None:
    """Returns the town that a recording names, or None.

    It is a shipped or generated one, or a file `<name>.xodr` or `.yaml` in `maps`. The name states lights by default.

    Raises:
        TownError: the file is malformed.
    """
    if is_generated(name):
        return load_town(name)
    name, lights = split_lights(name)
    if not _PLAIN_NAME.fullmatch(name):  # a name from a file must not be a path
        return None
    if name in town_names():
        return load_town(name)
    suffixes = _SUFFIXES if lights is Lights.MAP else _SUFFIXES[:1]
    candidates = [] if maps is None else [maps / f"{name}{suffix}" for suffix in suffixes]
    return next((load_town(path, lights=lights) for path in candidates if path.is_file()), None)


def _load(path: Path, lights: Lights) -> Town:
    file, modified, size = _stamp(path)
    return _read(file, modified, size) if lights is Lights.MAP else _with_lights(file, modified, size)


@lru_cache(maxsize=16)
def _with_lights(path: Path, modified: int, size: int) -> Town:
    """Adds default lights to each version of a file once per process."""
    return with_default_lights(_read(path, modified, size), ImportNotes(str(path)))


def _stamp(path: Path) -> tuple[Path, int, int]:
    """Returns the resolved path of a map, and its modification time and size.

    Raises:
        TownError: the file cannot be read.
    """
    try:
        resolved = path.resolve(strict=True)
        stamp = resolved.stat()
        check_file(resolved, MAX_OPENDRIVE)
    except OSError as error:
        raise TownError(str(path), "file", f"cannot be read ({error.strerror}); check the path") from error
    except InputFileError as error:
        raise TownError(str(path), "file", error.reason) from None
    except ValueError as error:  # a null character in the path
        raise TownError(repr(str(path)), "file", f"cannot be read ({error}); check the path") from None
    return resolved, stamp.st_mtime_ns, stamp.st_size


@lru_cache(maxsize=16)
def _read(path: Path, _modified: int, _size: int) -> Town:
    """Reads each version of a file once per process; modification time and size distinguish versions."""
    return through_cache(path, _compile)


@lru_cache(maxsize=16)
def _generate(specification: TownSpecification) -> tuple[Town, ImportNotes]:
    """Generates each town once per process, as long as it is among the last ones."""
    town, notes = generated.generate_town(specification)
    check_extent(town, town.name)
    return town, notes


def _compile(path: Path) -> Town:
    town, notes = _import(path)
    notes.log()
    return town


def _import(path: Path) -> tuple[Town, ImportNotes]:
    read = opendrive.import_opendrive if path.suffix.lower() == ".xodr" else yaml.import_yaml_town
    town, notes = read(path)
    check_extent(town, str(path))
    return town, notes


# --- Summary figures -------------------------------------------------------------------------------------------------


def describe(town: Town) -> dict[str, JsonValue]:
    """Returns summary figures of a town as JSON-compatible values.

    Returns:
        name: name of the town;
        traffic: side of the road on which vehicles drive, "right" or "left";
        lanes, links: counts; connectors are included, lane changes are not;
        components: sizes of the strongly connected components of the lanes without lane changes, largest first;
        components_with_lane_changes: the same with lane changes;
        kilometres: length of all lanes, rounded to 10 m;
        junctions: count;
        streets: names;
        signals: number of traffic lights;
        crosswalks, sites: counts.
    """
    onward = [link for link in town.links if not link.type.is_lane_change]
    return {
        "name": town.name,
        "traffic": str(town.traffic),
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
    """Returns the sizes of the strongly connected components, largest first."""
    if lanes == 0:
        return []
    pairs = np.array([(link.source, link.target) for link in links], dtype=np.intp).reshape(-1, 2)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(lanes, lanes)).tocsr()
    _, labels = connected_components(graph, directed=True, connection="strong")
    return sorted((int(size) for size in np.bincount(labels)), reverse=True)
