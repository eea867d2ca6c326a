"""`manifest.json`: what a corpus holds, with hashes that tell whether it still does."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from dorothie_gym.sessions.encoding import decode_text, from_line, read_bytes, to_page, write_atomically
from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.sessions.fields import Fields
from dorothie_gym.sessions.folds import fold_of_folder
from dorothie_gym.sessions.session import Session
from dorothie_gym.sessions.version import parse_version

MANIFEST_FILE: Final = "manifest.json"
MANIFEST_VERSION: Final = "1.0"


def manifest_row(session: Session, folder: Path, root: Path) -> dict[str, Any]:
    """Returns the row of a session: path within the corpus, fold, town, counts, hash of its content.

    Args:
        session: the session.
        folder: where it lies.
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


def write_manifest(root: Path, rows: Sequence[Mapping[str, Any]]) -> Path:
    """Writes the manifest of a corpus, rows by path, with a hash of them all; whole or not at all.

    Returns:
        Its path.

    Raises:
        OSError: it cannot be written.
    """
    ordered = sorted(rows, key=lambda row: str(row["path"]))
    page = {"version": MANIFEST_VERSION, "sha256": _digest(ordered), "sessions": [dict(row) for row in ordered]}
    write_atomically(root / MANIFEST_FILE, to_page(page))
    return root / MANIFEST_FILE


def read_manifest(root: Path) -> dict[str, str]:
    """Returns the hash of each session by its path within the corpus.

    Raises:
        SessionError: there is no manifest, it is damaged, or of a newer version.
    """
    path = root / MANIFEST_FILE
    if not path.is_file():
        raise SessionError(f"{path}: is missing; write it with Corpus.write_manifest")
    fields = Fields(from_line(decode_text(read_bytes(path), str(path)), str(path)), str(path))
    if parse_version(fields.text("version"), str(path))[0] != 1:
        raise fields.error("version", "1.x")
    rows = [{"path": row.text("path"), "sha256": row.text("sha256")} for row in fields.objects("sessions")]
    if _digest(rows) != fields.text("sha256"):
        raise SessionError(f"{path}: its rows do not fit its own hash; it was changed or is damaged")
    return {row["path"]: row["sha256"] for row in rows}


def verify_manifest(root: Path, sessions: Mapping[Path, Callable[[], Session]]) -> tuple[str, ...]:
    """Returns how a corpus differs from its manifest, a sentence each.

    Args:
        root: folder of the corpus.
        sessions: the sessions that were found, by folder, and what reads each. No path of the manifest is opened.

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


def _digest(rows: Sequence[Mapping[str, Any]]) -> str:
    lines = (f"{row['sha256']}  {row['path']}\n" for row in rows)
    return hashlib.sha256("".join(lines).encode("utf-8", "surrogateescape")).hexdigest()
