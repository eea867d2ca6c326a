"""Arrays that the camera computes once and keeps in the user's cache, each set in an `.npz` archive of its own."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import io
import logging
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.cache import compiler_digest, package_sources, remove_oldest
from dorothie_gym.support.user_cache import cache_folder, discard, read_signed, write_signed

_PACKAGES = ("dorothie_gym.pictures.camera", "dorothie_gym.pictures", "dorothie_gym.sim", "dorothie_gym.ontology")
_log = logging.getLogger(__name__)

Arrays: TypeAlias = Mapping[str, NDArray[Any]]
"""Arrays by the names of their members in an archive."""

Kept = TypeVar("Kept")
Table = TypeVar("Table", bound=tuple[NDArray[Any], ...])


def through_cache(
    folder: str,
    key: bytes,
    most: int,
    *,
    build: Callable[[], Kept],
    pack: Callable[[Kept], Arrays],
    unpack: Callable[[Arrays], Kept],
) -> Kept:
    """Returns the entry of the user's cache under a key, or builds it and adds it to the cache.

    A damaged entry is replaced (`user_cache.read_signed`). A cache that cannot be written is logged at level DEBUG and
    otherwise ignored.

    Args:
        folder: name of the folder in the cache.
        key: bytes that determine the content, in addition to the sources of the camera.
        most: maximum number of archives in the folder; the oldest are removed beyond it.
        build: makes the content.
        pack: returns the arrays of the content.
        unpack: returns the content of such arrays; `KeyError` and `ValueError` mean that they are damaged.
    """
    entry = _entry(folder, key)
    data = None if entry is None else read_signed(entry)
    if entry is not None and data is not None:
        try:
            return unpack(from_bytes(data))
        except (KeyError, OSError, ValueError, zipfile.BadZipFile) as error:
            discard(entry, str(error))
    content = build()
    if entry is not None:
        try:
            write_signed(entry, to_bytes(pack(content)))
            remove_oldest(entry.parent, most)
        except OSError as error:
            _log.debug("%s cannot be kept in the cache: %s", entry, error)
    return content


def to_bytes(arrays: Arrays) -> bytes:
    """Returns arrays as the bytes of an `.npz` file."""
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def from_bytes(data: bytes) -> Arrays:
    """Returns the arrays that `to_bytes` has written.

    Raises:
        KeyError, OSError, ValueError, zipfile.BadZipFile: the bytes hold no arrays.
    """
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def columns(name: str, table: tuple[NDArray[Any], ...]) -> Arrays:
    """Returns the arrays of a named tuple by the names of their members."""
    fields: tuple[str, ...] = vars(type(table))["_fields"]
    return {f"{name}.{field}": column for field, column in zip(fields, table, strict=True)}


def table_of(arrays: Arrays, name: str, kind: Callable[..., Table]) -> Table:
    """Returns the named tuple that `columns` has split."""
    fields: tuple[str, ...] = vars(kind)["_fields"]
    return kind(*(arrays[f"{name}.{field}"] for field in fields))


@functools.cache
def builder_digest() -> str | None:
    """Returns a digest of all that determines the scene of a town except the town itself; None if it cannot be read."""
    compiler = compiler_digest()
    if compiler is None:
        return None
    import shapely  # here: cached entries do not need it

    versions = [importlib.metadata.version(name) for name in ("highway-env", "pillow", "shapely")]
    digest = hashlib.sha256(f"{compiler} {versions} {shapely.geos_version_string}\n".encode())
    for package in _PACKAGES:
        for name, text in package_sources(package):
            digest.update(f"{package} {name} {len(text)}\n".encode() + text)
    return digest.hexdigest()


def _entry(folder: str, key: bytes) -> Path | None:
    """Returns the archive of a key, which need not exist; None if caching is turned off."""
    cache, builder = cache_folder(), builder_digest()
    if cache is None or builder is None:
        return None
    return cache / folder / f"{hashlib.sha256(builder.encode() + key).hexdigest()}.npz"
