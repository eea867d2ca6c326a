"""Writing a whole session at once."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from dorothie_gym.sessions.decisions import encode_decision
from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.sessions.event_lines import encode_event
from dorothie_gym.sessions.frames_file import write_frames
from dorothie_gym.sessions.layout import ACTIONS_FILE, EVENTS_FILE, FRAMES_FILE, PART, PICTURES_FOLDER
from dorothie_gym.sessions.session_file import SessionFile

if TYPE_CHECKING:
    from dorothie_gym.sessions.session import Session


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """Gives a folder to fill, which takes its name when the block is left, and is gone when the block fails.

    Raises:
        SessionError: there is something of that name already.
    """
    if os.path.lexists(folder) and not (folder.is_dir() and not folder.is_symlink() and not any(folder.iterdir())):
        raise SessionError(f"{folder}: exists already; choose another name, or remove it first")
    folder.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(prefix=f".{folder.name[:80]}.", suffix=PART, dir=folder.parent))
    try:
        part.chmod(0o755)  # temporary folders are closed to everybody else
        yield part
        part.rename(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def save_folder(session: Session, folder: Path) -> Path:
    """Writes a session into a new folder; see `Session.save`."""
    with new_folder(folder) as part:
        lines = [encode_event(event) + "\n" for event in session.events]
        (part / EVENTS_FILE).write_text("".join(lines), encoding="utf-8", newline="\n")
        if session.decisions is not None:
            lines = [encode_decision(decision) + "\n" for decision in session.decisions]
            (part / ACTIONS_FILE).write_text("".join(lines), encoding="utf-8", newline="\n")
        write_frames(part / FRAMES_FILE, session.trajectory, session.scene)
        if session.pictures:
            (part / PICTURES_FOLDER).mkdir()
            for frame, picture in session.pictures.items():
                shutil.copyfile(picture, part / PICTURES_FOLDER / picture_name(frame))
        outcome = session.summary if session.complete else None
        file = SessionFile(
            header=session.header, outcome=outcome, events=len(session.events), frames=len(session.trajectory)
        )
        file.write(part)
    return folder


def picture_name(frame: int) -> str:
    """Returns the name of the picture of a frame."""
    return f"{frame:06d}.png"
