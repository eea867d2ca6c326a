"""Columns of all sessions of a corpus, kept in the user's cache.

An entry of the cache is a folder of memory-mapped `.npy` files, and `columns.json` with all other values and a checksum
of each file. Its name is a hash of all that determines its content. A damaged entry is rebuilt and replaced.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import json
import logging
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.corpus import FOLDS, Corpus, CorpusEntry, Fold
from dorothie_gym.errors import FeatureStoreError, SessionError, TownError, one_line
from dorothie_gym.evaluation.teacher_forced.features.column_checks import fault_in
from dorothie_gym.evaluation.teacher_forced.features.columns import GROUPS, NO_TEXT, Columns, SessionRows, TownGraph
from dorothie_gym.evaluation.teacher_forced.features.session_columns import SessionColumns, extract, town_graph
from dorothie_gym.evaluation.teacher_forced.features.sight import Sight, seen_by
from dorothie_gym.maps.cache import compiler_digest
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.session.recording.files import ACTIONS_FILE
from dorothie_gym.support.files import PART
from dorothie_gym.support.input_files import ARRAY_ERRORS, MIB, checked, parse_json, raising, read_file, read_text
from dorothie_gym.support.user_cache import (
    cache_folder,
    discard,
    is_private,
    is_signed,
    make_private,
    mark_used,
    remove,
    sign,
)

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session

_log = logging.getLogger(__name__)

_SOURCES: Final = (
    "ontology",
    "dialogue",
    "maps",
    "sim",
    "session/recording",
    "archive",
    "evaluation/analysis",
    "evaluation/teacher_forced/features",
)
"""Packages whose source determines the columns of a session."""

_READ: Final = (".json", ".jsonl", ".csv", ".parquet", ".journal")
"""Suffixes of the files of sessions."""


def build(
    corpus: Corpus | Path | str,
    *,
    sight: Sight | None = None,
    cache: bool = True,
    on_session: Callable[[], object] | None = None,
) -> Columns:
    """Returns a corpus as columns, from the cache or newly built.

    Args:
        corpus: corpus or its folder.
        sight: source of the objects around the ego; None for the record.
        cache: whether to use the user's cache folder (`DOROTHIE_GYM_CACHE`).
        on_session: called after each session that was read.

    Raises:
        SessionError: no session can be read.
    """
    corpus = corpus if isinstance(corpus, Corpus) else Corpus.load(corpus)
    key = _key(corpus, sight)
    found = recall(key) if cache else None
    if found is None:
        found = _build(corpus, key, sight, on_session)
        if cache:
            keep(found)
    return found


def columns_of(session: Session, fold: str = "", maps: Path | None = None, sight: Sight | None = None) -> Columns:
    """Returns the columns of a single session; they are not cached."""
    town = find_town(session.header.town, maps)
    part = extract(seen_by(sight, session, town), town)
    return join(part.signature, [session.name], [fold], [part], [town_graph(part.town, town)], [])


def _build(corpus: Corpus, key: str, sight: Sight | None, on_session: Callable[[], object] | None) -> Columns:
    towns: dict[str, Town | None] = {}
    read: list[tuple[CorpusEntry, SessionColumns]] = []
    unreadable = []
    for entry in corpus.entries:
        try:
            session = entry.load()
            if session.header.town not in towns:
                towns[session.header.town] = find_town(session.header.town, entry.maps)
            town = towns[session.header.town]
            read.append((entry, extract(seen_by(sight, session, town), town)))
        except (SessionError, TownError) as error:
            unreadable.append((entry.name, str(error)))
        if on_session is not None:
            on_session()
    if not read:
        reason = unreadable[0][1] if unreadable else "there is none"
        raise SessionError(f"{corpus.root}: no session can be read: {reason}")
    read.sort(key=_place)
    names = sorted({part.town for _, part in read})
    return join(
        key,
        [entry.name for entry, _ in read],
        [_fold_name(entry.fold) for entry, _ in read],
        [part for _, part in read],
        [town_graph(name, towns[name]) for name in names],
        unreadable,
    )


def _place(row: tuple[CorpusEntry, SessionColumns]) -> tuple[int, str, int, str]:
    """Returns the sort key of a session, which does not depend on names: they differ between layouts."""
    entry, part = row
    fold = entry.fold
    place = FOLDS.index(fold) if fold in FOLDS else len(FOLDS) + (0 if fold is None else 1)
    return place, part.town, part.seed, part.signature


def _fold_name(fold: Fold | None) -> str:
    return "" if fold is None else fold.value


def _key(corpus: Corpus, sight: Sight | None) -> str:
    """Returns the hash of all that determines the columns: files, names and folds of sessions, and sources."""
    digest = hashlib.sha256(f"{_sources_digest()} {compiler_digest()} numpy {np.__version__}\n".encode())
    if sight is not None:
        digest.update(f"sight {sight.digest}\n".encode())
    for folder in sorted({entry.maps for entry in corpus.entries if entry.maps is not None}):
        _add_files(digest, folder, (".xodr", ".yaml", ".yml"))
    for entry in corpus.entries:
        digest.update(f"session {entry.name!r} {entry.fold} {entry.sign!r}\n".encode())
        _add_files(digest, entry.path, _READ)
    return digest.hexdigest()


def _add_files(digest: hashlib._Hash, folder: Path, endings: tuple[str, ...]) -> None:
    for path in sorted(folder.iterdir()):
        if path.suffix in endings and path.name != ACTIONS_FILE and path.is_file():
            with path.open("rb") as file:
                digest.update(f"{path.name} {hashlib.file_digest(file, 'sha256').hexdigest()}\n".encode())


@functools.cache
def _sources_digest() -> str:
    digest = hashlib.sha256()
    package = files("dorothie_gym")
    for name in _SOURCES:
        for path, text in sorted(_sources(package.joinpath(*name.split("/")), name)):
            digest.update(f"{path} {len(text)}\n".encode() + text)
    return digest.hexdigest()


def _sources(folder: Traversable, prefix: str) -> Iterator[tuple[str, bytes]]:
    for entry in folder.iterdir():
        if entry.is_dir():
            yield from _sources(entry, f"{prefix}/{entry.name}")
        elif entry.name.endswith(".py"):
            yield f"{prefix}/{entry.name}", entry.read_bytes()


# --- Columns of sessions joined to those of a corpus ------------------------------------------------------------------

_STARTS = {"landmarks": "place", "streets": "text"}
"""Groups whose rows are found by session, with a column that gives their number."""


def join(
    key: str,
    names: Sequence[str],
    folds: Sequence[str],
    parts: Sequence[SessionColumns],
    towns: Sequence[TownGraph],
    unreadable: Sequence[tuple[str, str]],
) -> Columns:
    """Joins the columns of sessions to those of a corpus.

    Args:
        key: hash of all that determines them.
        names: names of the sessions.
        folds: their folds.
        parts: their columns, in the same order.
        towns: the towns that occur.
        unreadable: sessions that could not be read, (name, reason) each.
    """
    pool: dict[str, int] = {}
    rows = [_Shifted(part, pool) for part in parts]
    groups: dict[str, Any] = {}
    for group, kind in GROUPS.items():
        if group != "sessions":
            wanted = [field.name for field in dataclasses.fields(kind)]
            groups[group] = kind(**{name: _column(rows, group, name) for name in wanted})
    number = {town.name: index for index, town in enumerate(towns)}
    groups["sessions"] = SessionRows(
        names=tuple(names),
        folds=tuple(folds),
        town=np.array([number[part.town] for part in parts], dtype=np.int32),
        has_objects=np.concatenate([part.arrays["sessions.has_objects"] for part in parts]),
    )
    return Columns(
        key=key,
        **groups,
        texts=tuple(pool),
        towns=tuple(towns),
        unreadable=tuple(unreadable),
        unpointed=tuple((index, *found) for index, part in enumerate(parts) for found in part.unpointed),
    )


class _Shifted:
    """Arrays of a session, with texts as indices of the corpus."""

    def __init__(self, part: SessionColumns, pool: dict[str, int]) -> None:
        self.arrays = part.arrays
        numbers = np.array([pool.setdefault(text, len(pool)) for text in part.texts] + [NO_TEXT], dtype=np.int32)
        self._numbers = numbers  # -1 picks the last, which is -1

    def column(self, group: str, name: str) -> NDArray[Any]:
        found = self.arrays[f"{group}.{name}"]
        return self._numbers[found] if name.endswith("text") else found

    def count(self, group: str) -> int:
        return len(next(rows for name, rows in self.arrays.items() if name.startswith(f"{group}.")))


_POINTS_AT = {("moves", "utterance"): "utterances", ("frames", "look"): "looks", ("looks", "start"): "objects"}
"""Columns that refer to rows of another group."""


def _column(rows: Sequence[_Shifted], group: str, name: str) -> NDArray[np.generic]:
    if name == "session":
        return np.repeat(np.arange(len(rows), dtype=np.int32), [row.count(group) for row in rows])
    if name == "start" and group in _STARTS:
        return np.concatenate(([0], np.cumsum([row.count(group) for row in rows]))).astype(np.int64)
    columns = [row.column(group, name) for row in rows]
    target = _POINTS_AT.get((group, name))
    if target is not None:
        first = np.concatenate(([0], np.cumsum([row.count(target) for row in rows])))
        # -1 means that there is none
        columns = [
            np.where(column >= 0, column + start, column).astype(column.dtype)
            for column, start in zip(columns, first, strict=False)
        ]
        if name == "start":
            columns.append(first[-1:].astype(np.int64))
    return np.concatenate(columns)


# --- Cache ------------------------------------------------------------------------------------------------------------

INDEX_FILE: Final = "columns.json"

SIGNATURE_FILE: Final = "columns.signature"
"""File with the signature of the index, which holds the hashes of all other files."""

MAX_INDEX: Final = 256 * MIB
"""Largest index [bytes]; it holds every text of the corpus once."""

EMPTY: Final = 128
"""Size of an empty `.npy` file, which is its header [bytes]."""

MOST_ENTRIES: Final = 12
"""Maximum number of entries; the least recently used are removed. An entry of 183 sessions has about 40 MB."""


def features_folder() -> Path | None:
    """Returns the folder of cached columns; None if the cache is switched off."""
    cache = cache_folder()
    return None if cache is None else cache / "features"


def recall(key: str) -> Columns | None:
    """Returns the cached columns of a key; None if they are missing or damaged."""
    folder = features_folder()
    if folder is None:
        return None
    entry = folder / key
    if not entry.exists() or not is_private(entry):
        return None
    try:
        _check_signature(entry, folder.parent)
        columns = read_columns(entry)
    except (OSError, FeatureStoreError) as error:
        discard(entry, str(error))
        return None
    mark_used(entry)
    return columns


def _check_signature(entry: Path, keys: Path) -> None:
    with raising(FeatureStoreError):
        index, signature = (read_file(entry / name, MAX_INDEX) for name in (INDEX_FILE, SIGNATURE_FILE))
    if not is_signed(index, signature, keys, entry.name):
        raise FeatureStoreError("its signature is wrong")


def keep(columns: Columns) -> None:
    """Caches columns under their key atomically: other processes see the whole entry or none."""
    folder = features_folder()
    if folder is None:
        return
    try:
        make_private(folder)
        part = Path(tempfile.mkdtemp(prefix=f"{columns.key[:16]}.", suffix=PART, dir=folder))
        try:
            write_columns(columns, part)
            signature = sign((part / INDEX_FILE).read_bytes(), folder.parent, columns.key)
            (part / SIGNATURE_FILE).write_bytes(signature)
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
            remove(target)
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
    try:
        arrays = {name: _array(folder / f"{Path(name).name}.npy", digest) for name, digest in page["files"].items()}
        columns = _columns(page, arrays)
    except (KeyError, AttributeError, *ARRAY_ERRORS) as error:
        raise FeatureStoreError(f"{folder}: is no entry of this version ({one_line(repr(error))})") from None
    if fault := fault_in(columns):
        raise FeatureStoreError(f"{folder}: {fault}")
    return columns


def _page(path: Path) -> dict[str, Any]:
    with raising(FeatureStoreError):
        digest, _, text = read_text(path, MAX_INDEX).partition("\n")
    text = text.removesuffix("\n")
    if hashlib.sha256(text.encode()).hexdigest() != digest:
        raise FeatureStoreError(f"{path}: does not fit its checksum")
    with raising(FeatureStoreError):
        return checked(parse_json(text, path), dict[str, Any], path)


def _array(path: Path, digest: str) -> NDArray[np.generic]:
    if not path.is_file() or _digest(path) != digest:
        raise FeatureStoreError(f"{path}: is missing, or does not fit its checksum")
    if path.stat().st_size <= EMPTY:  # empty files cannot be mapped
        empty: NDArray[np.generic] = np.load(path, allow_pickle=False)
        return empty
    mapped: NDArray[np.generic] = np.asarray(np.load(path, mmap_mode="r", allow_pickle=False))
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


def _arrays(columns: Columns) -> dict[str, NDArray[np.generic]]:
    """Returns every array by the name of its file."""
    found = {
        f"{group}.{name}": getattr(getattr(columns, group), name)
        for group, kind in GROUPS.items()
        for name in _array_fields(kind)
    }
    for k, town in enumerate(columns.towns):
        found |= {f"towns.{k}.{name}": getattr(town, name) for name in _array_fields(TownGraph)}
    return found


def _array_fields(kind: type[DataclassInstance]) -> list[str]:
    return [field.name for field in dataclasses.fields(kind) if field.name not in ("name", "names", "folds")]


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _prune(folder: Path) -> None:
    """Removes the least recently used entries beyond `MOST_ENTRIES`."""
    entries = sorted(folder.iterdir(), key=lambda entry: (entry.lstat().st_mtime_ns, entry.name))
    for entry in entries[:-MOST_ENTRIES]:
        with contextlib.suppress(OSError):  # another process may also remove entries
            remove(entry)
