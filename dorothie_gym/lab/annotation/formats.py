"""Formats in which annotations are exported and imported: native and SDN layouts of sessions, JSONL, ELAN."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import TYPE_CHECKING

from dorothie_gym.archive.corpus import layout_of, read_session
from dorothie_gym.archive.sdn.writer import write_sdn
from dorothie_gym.errors import AnnotationError
from dorothie_gym.lab.annotation.elan_reader import read_elan
from dorothie_gym.lab.annotation.elan_writer import write_elan
from dorothie_gym.lab.annotation.jsonl_format import read_jsonl, write_jsonl
from dorothie_gym.lab.annotation.session_labels import recorded_annotation, relabelled
from dorothie_gym.lab.annotation.source_text import SourceText

if TYPE_CHECKING:
    from dorothie_gym.lab.annotation.marks import Annotation
    from dorothie_gym.session.recording.session import Session


class Format(enum.StrEnum):
    """Format of an annotation."""

    NATIVE = "native"
    """Copy of the session with the labels of the annotation, in the native layout."""
    SDN = "sdn"
    """The same in SDN's release layout."""
    JSONL = "jsonl"
    ELAN = "elan"

    @property
    def suffix(self) -> str:
        """Ending of the name of a file; empty for formats that are folders."""
        return {Format.JSONL: ".jsonl", Format.ELAN: ".eaf"}.get(self, "")


def export_annotation(
    session: Session,
    annotation: Annotation,
    annotator: str,
    path: Path,
    to: Format,
    *,
    maps: Path | None = None,
) -> Path:
    """Writes an annotation.

    Args:
        session: the session.
        annotation: its annotation; in the layouts of sessions every span must have a move.
        annotator: name of the annotator.
        path: file or new folder.
        to: the format.
        maps: folder with maps of towns that are not shipped, for SDN.

    Returns:
        The path.

    Raises:
        AnnotationError: a span has no move, or the format cannot represent a character.
        SessionError: the folder exists.
        OSError: the file or folder cannot be written.
    """
    text = SourceText.of(session)
    if to is Format.JSONL:
        write_jsonl(path, text, annotation, annotator)
    elif to is Format.ELAN:
        write_elan(path, text, annotation, annotator)
    else:
        copy = relabelled(session, text, annotation, annotator)
        if to is Format.SDN:
            write_sdn(copy, path, maps=maps)
        else:
            copy.save(path)
    return path


def format_of(path: Path) -> Format:
    """Returns the format of a file or folder; raises `AnnotationError` for an unknown format."""
    layout = layout_of(path) if path.is_dir() else None
    if layout is not None:
        return Format.NATIVE if layout == "native" else Format.SDN
    for each in (Format.JSONL, Format.ELAN):
        if path.suffix.lower() == each.suffix and path.is_file():
            return each
    raise AnnotationError(
        f"{path}: is no annotation; give a .jsonl or .eaf file, or the folder of a session (native or SDN)"
    )


def import_annotation(session: Session, path: Path, *, maps: Path | None = None) -> Annotation:
    """Returns the annotation in a file or folder of any format, for a session.

    Raises:
        AnnotationError: it does not match the session.
        SessionError: it cannot be read.
    """
    text, found = SourceText.of(session), format_of(path)
    if found is Format.JSONL:
        return read_jsonl(path, text)
    if found is Format.ELAN:
        return read_elan(path, text)
    return recorded_annotation(read_session(path, maps=maps), text)
