"""Versions of the session format: which are read."""

from __future__ import annotations

import re
from typing import Final

from dorothie_gym.errors import SessionError
from dorothie_gym.errors import short_repr as shown

FORMAT_VERSION: Final = "2.0"
"""Version of the layout of a session folder, "major.minor".

Another minor version only adds fields, columns and types of events; another major version changes what is there.
"""

OLD_VERSION: Final = "1.0"
"""Version of the folders with `trajectory.csv` and `summary.json`; their headers say plainly 1."""

_PATTERN: Final = re.compile(r"(\d{1,4})\.(\d{1,4})")


def parse_version(value: object, where: str) -> tuple[int, int]:
    """Returns major and minor number of the version of a file.

    Args:
        value: what the file says: "major.minor", or the number 1 in the oldest.
        where: name of the file, for messages.

    Raises:
        SessionError: it is no version, or one of a newer major number than this package reads.
    """
    match = _PATTERN.fullmatch(OLD_VERSION if value == 1 and type(value) is int else str(value))
    if match is None or isinstance(value, float):
        raise SessionError(f"{where}: field 'format_version' is {shown(value)}; it must be like \"{FORMAT_VERSION}\"")
    major, minor = int(match[1]), int(match[2])
    ours = int(FORMAT_VERSION.partition(".")[0])
    if major > ours or major < 1:
        raise SessionError(
            f"{where}: format version {major}.{minor} cannot be read; this dorothie_gym reads up to {ours}.x: update it"
        )
    return major, minor


def is_newer(version: str) -> bool:
    """Whether a version of a session is a later minor one than this package's."""
    return parse_version(version, "session") > parse_version(FORMAT_VERSION, "session")
