"""Cache of columns as files in the user's cache folder.

An entry is a folder of memory-mapped `.npy` files, and `columns.json` with all other values and a checksum of each
file. Its name is a hash of everything that determines its content. A damaged entry is built again and replaced; the
checksums guard against accidents, not against attackers with access to the cache folder.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import logging
import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.benchmark.features.columns import GROUPS, Columns, TownGraph
from dorothie_gym.errors import FeatureStoreError
from dorothie_gym.files import PART
from dorothie_gym.user_cache import cache_folder

INDEX_FILE: Final = "columns.json"

EMPTY: Final = 128
"""Size of an empty `.npy` file, which is its header [bytes]."""

MOST_ENTRIES: Final = 12
"""Largest number of entries; the least recently used are removed. An entry of 183 sessions has about 40 MB."""

_log = logging.getLogger(__name__)


def features_folder() -> Path | None:
    """Returns the folder of cached columns; None if the cache is switched off."""
    cache = cache_folder()
    return None if cache is None else cache / "features"


def recall(key: str) -> Columns | None:
    """Returns the cached columns of a key; None if they are missing or damaged."""
    folder = features_folder()
    if folder is None:
        return None
    try:
        columns = read_columns(folder / key)
        os.utime(folder / key)
    except FileNotFoundError:
        return None
    except (OSError, FeatureStoreError) as error:
        _log.debug("the cached features %s cannot be read and are built again: %s", folder / key, error)
        return None
    return columns if columns.key == key else None


def keep(columns: Columns) -> None:
    """Caches columns under their key, in one step: other processes see the whole entry or none."""
    folder = features_folder()
    if folder is None:
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=f"{columns.key[:16]}.", suffix=PART, dir=folder))
        try:
            write_columns(columns, part)
            _publish(part, folder / columns.key)
        finally:
            shutil.rmtree(part, ignore_errors=True)
        _prune(folder)
    except OSError as error:
        _log.debug("features cannot be kept in %s: %s", folder, error)


def _publish(part: Path, target: Path) -> None:
    """Renames a finished folder, unless another process was faster."""
    try:
        part.rename(target)
    except OSError:
        if recall(target.name) is None:  # the existing entry is damaged
            shutil.rmtree(target)
            part.rename(target)


def write_columns(columns: Columns, folder: Path) -> None:
    """Writes columns into an empty folder.

    Raises:
        OSError: it cannot be written.
    """
    files = {}
    for name, array in _arrays(columns).items():
        path = folder / f"{name}.npy"
        np.save(path, array, allow_pickle=False)
        files[name] = _digest(path)
    page = {
        "key": columns.key,
        "names": columns.sessions.names,
        "folds": columns.sessions.folds,
        "texts": columns.texts,
        "towns": [town.name for town in columns.towns],
        "unreadable": columns.unreadable,
        "unpointed": columns.unpointed,
        "files": files,
    }
    text = json.dumps(page, ensure_ascii=False)
    page_digest = hashlib.sha256(text.encode()).hexdigest()
    (folder / INDEX_FILE).write_text(f"{page_digest}\n{text}\n", encoding="utf-8", newline="\n")


def read_columns(folder: Path) -> Columns:
    """Reads columns, with arrays as memory maps of their files.

    Raises:
        FileNotFoundError: there is no entry.
        FeatureStoreError: a file is damaged or missing; the message names it.
        OSError: a file cannot be read.
    """
    page = _page(folder / INDEX_FILE)
    arrays = {name: _array(folder / f"{name}.npy", digest) for name, digest in page["files"].items()}
    try:
        return _columns(page, arrays)
    except (KeyError, TypeError) as error:
        raise FeatureStoreError(f"{folder}: {error} is missing") from None


def _page(path: Path) -> dict[str, Any]:
    digest, _, text = path.read_text(encoding="utf-8").partition("\n")
    text = text.removesuffix("\n")
    if hashlib.sha256(text.encode()).hexdigest() != digest:
        raise FeatureStoreError(f"{path}: does not fit its checksum")
    page: dict[str, Any] = json.loads(text)
    return page


def _array(path: Path, digest: str) -> NDArray[Any]:
    if not path.is_file() or _digest(path) != digest:
        raise FeatureStoreError(f"{path}: is missing, or does not fit its checksum")
    if path.stat().st_size <= EMPTY:  # empty files cannot be mapped
        empty: NDArray[Any] = np.load(path, allow_pickle=False)
        return empty
    mapped: NDArray[Any] = np.asarray(np.load(path, mmap_mode="r", allow_pickle=False))
    return mapped


def _columns(page: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Columns:
    groups: dict[str, Any] = {}
    for group, kind in GROUPS.items():
        found: dict[str, Any] = {name: arrays[f"{group}.{name}"] for name in _array_fields(kind)}
        if group == "sessions":
            found |= {"names": tuple(page["names"]), "folds": tuple(page["folds"])}
        groups[group] = kind(**found)
    towns = tuple(
        TownGraph(name=name, **{field: arrays[f"towns.{k}.{field}"] for field in _array_fields(TownGraph)})
        for k, name in enumerate(page["towns"])
    )
    return Columns(
        key=page["key"],
        **groups,
        texts=tuple(page["texts"]),
        towns=towns,
        unreadable=tuple((str(name), str(reason)) for name, reason in page["unreadable"]),
        unpointed=tuple((int(session), int(event), str(reason)) for session, event, reason in page["unpointed"]),
    )


def _arrays(columns: Columns) -> dict[str, NDArray[Any]]:
    """Returns every array by the name of its file."""
    found = {
        f"{group}.{name}": getattr(getattr(columns, group), name)
        for group, kind in GROUPS.items()
        for name in _array_fields(kind)
    }
    for k, town in enumerate(columns.towns):
        found |= {f"towns.{k}.{name}": getattr(town, name) for name in _array_fields(TownGraph)}
    return found


def _array_fields(kind: type[Any]) -> list[str]:
    return [field.name for field in dataclasses.fields(kind) if field.name not in ("name", "names", "folds")]


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _prune(folder: Path) -> None:
    """Removes the least recently used entries beyond `MOST_ENTRIES`."""
    entries = sorted(folder.iterdir(), key=lambda entry: (entry.stat().st_mtime_ns, entry.name))
    for entry in entries[:-MOST_ENTRIES]:
        shutil.rmtree(entry, ignore_errors=True)
