"""A corpus becomes columns."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Final

import numpy as np

from dorothie_gym.evaluation.features.columns import Columns
from dorothie_gym.evaluation.features.extraction import SessionColumns, extract
from dorothie_gym.evaluation.features.joining import join
from dorothie_gym.evaluation.features.store import keep, recall
from dorothie_gym.evaluation.features.towns import town_graph
from dorothie_gym.sessions import FOLDS, Corpus, CorpusEntry, Fold, Session, SessionError
from dorothie_gym.sessions.layout import ACTIONS_FILE
from dorothie_gym.sessions.sdn.maps import find_town
from dorothie_gym.world.town import Town, TownError
from dorothie_gym.world.town.store import compiler_digest

_SOURCES: Final = ("ontology", "dialogue", "sessions", "evaluation/features", "world")
"""Packages that decide what the columns of a session are."""

_READ: Final = (".json", ".jsonl", ".csv", ".parquet", ".journal")
"""Endings of files that sessions are read from."""


def build(corpus: Corpus | Path | str, *, cache: bool = True, told: Callable[[], object] | None = None) -> Columns:
    """Returns a corpus as columns: as it was kept when it was built before, else built and kept for the next time.

    Args:
        corpus: a corpus or its folder.
        cache: whether to look for it, and keep it, in the user's cache folder (`DOROTHIE_GYM_CACHE`).
        told: called after each session that was read.

    Raises:
        SessionError: there is no session, or none can be read.
    """
    corpus = corpus if isinstance(corpus, Corpus) else Corpus.load(corpus)
    key = _key(corpus)
    found = recall(key) if cache else None
    if found is None:
        found = _build(corpus, key, told)
        if cache:
            keep(found)
    return found


def columns_of(session: Session, fold: str = "", maps: Path | None = None) -> Columns:
    """Returns the columns of a session that is in no corpus; they are not kept."""
    town = find_town(session.header.town, maps)
    part = extract(session, town)
    return join(part.signature, [session.name], [fold], [part], [town_graph(part.town, town)], [])


def _build(corpus: Corpus, key: str, told: Callable[[], object] | None) -> Columns:
    towns: dict[str, Town | None] = {}
    read: list[tuple[CorpusEntry, SessionColumns]] = []
    unreadable = []
    for entry in corpus.entries:
        try:
            session = entry.load()
            if session.header.town not in towns:
                towns[session.header.town] = find_town(session.header.town, entry.maps)
            read.append((entry, extract(session, towns[session.header.town])))
        except (SessionError, TownError) as error:
            unreadable.append((entry.name, str(error)))
        if told is not None:
            told()
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
    """Order of sessions: it must not depend on names, which differ between layouts."""
    entry, part = row
    fold = entry.fold
    place = FOLDS.index(fold) if fold in FOLDS else len(FOLDS) + (0 if fold is None else 1)
    return place, part.town, part.seed, part.signature


def _fold_name(fold: Fold | None) -> str:
    return "" if fold is None else fold.value


def _key(corpus: Corpus) -> str:
    """Hash of all that decides the columns: what the sessions' files hold, their names and folds, and our sources."""
    digest = hashlib.sha256(f"{_sources_digest()} {compiler_digest()} numpy {np.__version__}\n".encode())
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
