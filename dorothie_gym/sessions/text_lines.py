"""Files of lines, of which the last may be torn."""

from __future__ import annotations

from pathlib import Path

from dorothie_gym.sessions.encoding import decode_text, read_bytes
from dorothie_gym.sessions.errors import SessionError


def read_lines(path: Path, limit: int) -> tuple[list[str], bool]:
    """Returns the complete lines of a file, and whether anything is missing: a torn last line, or the file.

    Raises:
        SessionError: more than `limit` lines, a line that is not UTF-8, or no regular file.
    """
    if not path.exists():
        return [], True
    content = read_bytes(path)
    if content.count(b"\n") > limit:
        raise SessionError(f"{path}: holds more than {limit} lines, which no session does; it is not read")
    *lines, rest = content.split(b"\n")
    return [decode_text(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1)], bool(rest)
