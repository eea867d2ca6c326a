"""Corpora: folders of sessions in any layout, their folds, and their manifest."""

from __future__ import annotations

import enum
import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Final, Self, TypedDict

from dorothie_gym.archive.export import export_tables
from dorothie_gym.archive.sdn.files import detect_layout
from dorothie_gym.archive.sdn.reader import read_sdn, settle_sign
from dorothie_gym.archive.sdn.turn_angles import SignVote
from dorothie_gym.errors import OntologyError, SessionError
from dorothie_gym.ontology.spellings import parse_exception
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.session.recording.events import Event, EventType, decode_event
from dorothie_gym.session.recording.files import (
    EVENTS_FILE,
    HEADER_FILE,
    decode_text,
    read_bytes,
    read_object,
    to_page,
)
from dorothie_gym.session.recording.header import parse_version
from dorothie_gym.session.recording.session import Session, read_session_file
from dorothie_gym.support.files import write_atomically

# --- Folds -----------------------------------------------------------------------------------------------------------


class Fold(enum.StrEnum):
    """Fold of a corpus; its value is the folder. Towns of the unseen folds do not occur in training (paper)."""

    TRAIN = "train"
    VAL_SEEN = "val/seen"
    VAL_UNSEEN = "val/unseen"
    TEST_SEEN = "test/seen"
    TEST_UNSEEN = "test/unseen"
    VAL = "val"
    TEST = "test"

    def matches(self, wanted: str) -> bool:
        """Returns whether the fold is `wanted` or one of its parts: "val" and "seen" have two each."""
        return wanted == self.value or wanted in self.value.split("/")


SPLITS: Final = ("train", "val", "test")
TOWN_GROUPS: Final = ("seen", "unseen")

FOLDS: Final = (Fold.TRAIN, Fold.VAL_SEEN, Fold.VAL_UNSEEN, Fold.TEST_SEEN, Fold.TEST_UNSEEN)
"""The folds of the paper's corpus."""

PAPER_FOLDS: Final[Mapping[Fold, int]] = MappingProxyType(dict(zip(FOLDS, (123, 14, 6, 25, 15), strict=True)))
"""Sessions of each fold of the paper's corpus, 183 in all (paper, section 4, table 2)."""


def fold_of_folder(folder: Path) -> Fold | None:
    """Returns the fold of a session's folder; None outside of folds."""
    parts = folder.absolute().parts[-3:-1]
    if len(parts) == 2 and parts[0] in SPLITS and parts[1] in TOWN_GROUPS:
        name = "/".join(parts)
    else:
        name = parts[-1] if parts else ""
    return next((fold for fold in Fold if fold.value == name), None)


def check_fold(wanted: str) -> str:
    """Returns the name of a fold or of a group of folds ("val", "seen"); raises `SessionError` for other names."""
    known = sorted({part for fold in Fold for part in (fold.value, *fold.value.split("/"))})
    if str(wanted) not in known:
        raise SessionError(f"fold: {str(wanted)!r} is unknown; choose from {', '.join(known)}")
    return str(wanted)


# --- Sessions of any layout ------------------------------------------------------------------------------------------


def layout_of(folder: Path) -> str | None:
    """Returns "native", or the SDN layout of the session in a folder; None without a session."""
    if (folder / HEADER_FILE).is_file():
        return "native"
    found = detect_layout(folder)
    return None if found is None else str(found)


def read_session(path: Path | str, *, maps: Path | str | None = None, sign: SignVote | None = None) -> Session:
    """Returns the session in a folder, of any layout.

    Args:
        path: the folder.
        maps: folder with the maps of SDN's towns.
        sign: vote on the sign of angles in an SDN session; see `read_sdn`.

    Raises:
        SessionError: there is no session, or it cannot be read.
    """
    folder = Path(path)
    if layout_of(folder) in ("native", None):
        return Session.load(folder)
    return read_sdn(folder, maps=maps, sign=sign)


def session_folders(path: Path | str) -> tuple[Path, ...]:
    """Returns the session folders in a folder and in its folds, by name; for a session, the folder itself.

    Raises:
        SessionError: there is no such folder, or it holds no session.
    """
    root = Path(path)
    if not root.is_dir():
        raise SessionError(f"{root}: there is no such folder; give a folder of sessions")
    if layout_of(root) is not None:
        return (root,)
    folders = tuple(_within(root, 2))
    if not folders:
        raise SessionError(f"{root}: holds no session (no folder in it has a {HEADER_FILE})")
    return folders


def _within(folder: Path, depth: int) -> Iterator[Path]:
    for child in sorted(folder.iterdir()):
        if child.name.startswith(".") or not child.is_dir():
            continue
        if layout_of(child) is not None:
            yield child
        elif depth and child.name in (*SPLITS, *TOWN_GROUPS):
            yield from _within(child, depth - 1)


def sign_of(folders: Sequence[Path]) -> SignVote | None:
    """Returns the vote of the SDN sessions among the folders on the sign of angles; None without SDN sessions."""
    read = [folder for folder in folders if layout_of(folder) not in ("native", None)]
    return settle_sign(read) if read else None


# --- Corpora ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class CorpusEntry:
    """Session of a corpus that has not been read yet.

    Attributes:
        path: its folder.
        maps: folder with the maps of SDN's towns.
        sign: vote on the sign of angles in SDN sessions.
    """

    path: Path
    maps: Path | None = None
    sign: SignVote | None = None

    @property
    def name(self) -> str:
        """Name of the session."""
        return self.path.name

    @property
    def fold(self) -> Fold | None:
        """Fold of the session; None outside of folds."""
        return fold_of_folder(self.path)

    def load(self) -> Session:
        """Returns the session; raises `SessionError` if it cannot be read."""
        return read_session(self.path, maps=self.maps, sign=self.sign)

    @cached_property
    def town(self) -> str:
        """Name of the session's town."""
        if layout_of(self.path) == "native":
            return read_session_file(self.path).header.town
        return self.load().header.town

    @cached_property
    def exceptions(self) -> frozenset[ExceptionKind]:
        """Kinds of exceptions that occur in the session."""
        if layout_of(self.path) != "native":
            return _kinds(self.load().events)
        path = self.path / EVENTS_FILE
        lines = read_bytes(path).split(b"\n")[:-1] if path.exists() else []
        found = (line for line in lines if b'"Exception"' in line)
        return _kinds(decode_event(decode_text(line, str(path)), str(path)) for line in found)


class Corpus:
    """Sessions of a folder, read one at a time.

    Args:
        root: folder of the corpus.
        entries: its sessions.
    """

    def __init__(self, root: Path, entries: Sequence[CorpusEntry]) -> None:
        self.root = root
        self.entries = tuple(entries)

    @classmethod
    def load(cls, path: Path | str, *, maps: Path | str | None = None) -> Self:
        """Returns the sessions of any layout in a folder and in its folds (`train`, `val/seen`, `val/unseen`, ...).

        Args:
            path: the folder.
            maps: folder with the maps of SDN's towns (`Town01.xodr`, ...).

        Raises:
            SessionError: there is no such folder, or it holds no session.
        """
        folders = session_folders(path)
        sign = sign_of(folders)
        where = None if maps is None else Path(maps)
        return cls(Path(path), [CorpusEntry(folder, where, sign) for folder in folders])

    def __len__(self) -> int:
        """Number of sessions."""
        return len(self.entries)

    def __iter__(self) -> Iterator[Session]:
        """Yields the sessions, reading one at a time; raises `SessionError` for one that cannot be read."""
        return (entry.load() for entry in self.entries)

    @property
    def folds(self) -> Mapping[Fold, int]:
        """Number of sessions of each fold that is not empty."""
        counts = {fold: sum(entry.fold is fold for entry in self.entries) for fold in (*FOLDS, Fold.VAL, Fold.TEST)}
        return {fold: count for fold, count in counts.items() if count}

    def filter(
        self,
        *,
        fold: Fold | str | None = None,
        town: str | None = None,
        exception: ExceptionKind | str | None = None,
    ) -> Self:
        """Returns the corpus of the sessions that match all given criteria.

        Args:
            fold: a fold, or a group of folds: "val", "test", "seen", "unseen".
            town: name of the town.
            exception: a kind that occurs, "environmental" or "task" for any of that type, "none" if none occurs.

        Raises:
            SessionError: the fold or the kind is unknown, or a session cannot be read.
        """
        entries: Sequence[CorpusEntry] = self.entries
        if fold is not None:
            wanted = check_fold(fold)
            entries = [entry for entry in entries if entry.fold is not None and entry.fold.matches(wanted)]
        if town is not None:
            entries = [entry for entry in entries if entry.town == town]
        if exception is not None:
            entries = [entry for entry in entries if _fits(entry.exceptions, exception)]
        return type(self)(self.root, entries)

    def write_manifest(self) -> Path:
        """Writes `manifest.json` into the corpus, with the hash of each session's content.

        Returns:
            Its path.

        Raises:
            SessionError: a session cannot be read.
            OSError: the file cannot be written.
        """
        return write_manifest(self.root, [manifest_row(entry.load(), entry.path, self.root) for entry in self.entries])

    def verify(self) -> tuple[str, ...]:
        """Returns the differences between the corpus and its `manifest.json`, one sentence each; empty if unchanged.

        Raises:
            SessionError: there is no manifest, or it is damaged.
        """
        return verify_manifest(self.root, {entry.path: entry.load for entry in self.entries})

    def export(self, path: Path | str) -> tuple[Path, Path]:
        """Writes the tables `utterances.parquet` and `decision_points.parquet` into a folder.

        Returns:
            Their paths; for their columns see `docs/session-format.md`.

        Raises:
            SessionError: a session cannot be read.
            OSError: the folder cannot be written.
        """
        return export_tables(
            ((None if entry.fold is None else entry.fold.value, entry.load()) for entry in self.entries), Path(path)
        )


def _fits(kinds: frozenset[ExceptionKind], wanted: ExceptionKind | str) -> bool:
    if wanted == "none":
        return not kinds
    if wanted == "environmental":
        return any(kind.is_environmental for kind in kinds)
    if wanted == "task":
        return any(kind.is_task for kind in kinds)
    try:
        return (wanted if isinstance(wanted, ExceptionKind) else parse_exception(wanted)) in kinds
    except OntologyError as error:
        raise SessionError(str(error)) from None


def _kinds(events: Iterator[Event] | Sequence[Event]) -> frozenset[ExceptionKind]:
    """Returns the kinds of exceptions among events; unknown kinds are skipped."""
    kinds = set()
    for event in events:
        if event.type is EventType.EXCEPTION:
            name = str(event.data.get("kind")).upper()
            if name in ExceptionKind.__members__:
                kinds.add(ExceptionKind[name])
    return frozenset(kinds)


def load_sessions(path: Path | str) -> tuple[Session, ...]:
    """Returns the sessions in a folder, by name; raises `SessionError` for the first that cannot be read."""
    return tuple(Corpus.load(path))


def load_readable(path: Path | str) -> tuple[tuple[Session, ...], dict[str, str]]:
    """Returns the readable sessions in a folder, by name, and the name and error of each unreadable one."""
    sessions: list[Session] = []
    unreadable: dict[str, str] = {}
    for entry in Corpus.load(path).entries:
        try:
            sessions.append(entry.load())
        except SessionError as error:
            unreadable[entry.name] = str(error)
    return tuple(sessions), unreadable


def split_by_name(sessions: Sequence[Session]) -> tuple[tuple[Session, ...], tuple[Session, ...]]:
    """Returns the sessions by name in two halves, for training and for testing; the second may be larger by one."""
    ordered = sorted(sessions, key=lambda session: session.name)
    middle = len(ordered) // 2
    return tuple(ordered[:middle]), tuple(ordered[middle:])


# --- Manifest --------------------------------------------------------------------------------------------------------

MANIFEST_FILE: Final = "manifest.json"
MANIFEST_VERSION: Final = "1.0"


class ManifestRow(TypedDict):
    """Session in a manifest: path within the corpus, fold, town, seed, counts, and SHA-256 of its content."""

    path: str
    fold: str | None
    town: str
    seed: int | None
    complete: bool
    events: int
    frames: int
    sha256: str


def manifest_row(session: Session, folder: Path, root: Path) -> ManifestRow:
    """Returns the manifest row of a session: path within the corpus, fold, town, counts, hash of its content.

    Args:
        session: the session.
        folder: its folder.
        root: folder of the corpus.
    """
    fold = fold_of_folder(folder)
    return {
        "path": _relative(folder, root),
        "fold": None if fold is None else fold.value,
        "town": session.header.town,
        "seed": session.header.seed,
        "complete": session.complete,
        "events": len(session.events),
        "frames": len(session.trajectory),
        "sha256": session.digest,
    }


def write_manifest(root: Path, rows: Sequence[ManifestRow]) -> Path:
    """Writes the manifest of a corpus, rows sorted by path, with a hash of all rows.

    Returns:
        Its path.

    Raises:
        OSError: it cannot be written.
    """
    ordered = sorted(rows, key=lambda row: row["path"])
    page = {"version": MANIFEST_VERSION, "sha256": _digest(ordered), "sessions": [dict(row) for row in ordered]}
    write_atomically(root / MANIFEST_FILE, to_page(page))
    return root / MANIFEST_FILE


def read_manifest(root: Path) -> dict[str, str]:
    """Returns the hash of each session by its path within the corpus.

    Raises:
        SessionError: there is no manifest, it is damaged, or of another major version.
    """
    path = root / MANIFEST_FILE
    if not path.is_file():
        raise SessionError(f"{path}: is missing; write it with Corpus.write_manifest")
    fields = read_object(path)
    parse_version(fields.text("version"), str(path), MANIFEST_VERSION)
    rows = [{"path": row.text("path"), "sha256": row.text("sha256")} for row in fields.objects("sessions")]
    if _digest(rows) != fields.text("sha256"):
        raise SessionError(f"{path}: its rows do not match its hash; it was changed or is damaged")
    return {row["path"]: row["sha256"] for row in rows}


def verify_manifest(root: Path, sessions: Mapping[Path, Callable[[], Session]]) -> tuple[str, ...]:
    """Returns the differences between a corpus and its manifest, one sentence each.

    Args:
        root: folder of the corpus.
        sessions: reader of each session found, by folder. No path of the manifest is opened.

    Raises:
        SessionError: there is no manifest, or it is damaged.
    """
    expected = read_manifest(root)
    faults = []
    found = {_relative(folder, root): load for folder, load in sessions.items()}
    for path in sorted(expected.keys() - found.keys()):
        faults.append(f"{path}: is missing")
    for path, load in sorted(found.items()):
        if path not in expected:
            faults.append(f"{path}: is not in the manifest")
            continue
        try:
            digest = load().digest
        except SessionError as error:
            faults.append(f"{path}: cannot be read ({error})")
            continue
        if digest != expected[path]:
            faults.append(f"{path}: its content was changed")
    return tuple(faults)


def _relative(folder: Path, root: Path) -> str:
    return folder.absolute().relative_to(root.absolute()).as_posix()


def _digest(rows: Sequence[Mapping[str, object]]) -> str:
    lines = (f"{row['sha256']}  {row['path']}\n" for row in rows)
    return hashlib.sha256("".join(lines).encode("utf-8", "surrogateescape")).hexdigest()
