"""A hash of what a session holds, whatever the libraries that packed its files."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sessions.decisions import encode_decision
from dorothie_gym.sessions.encoding import canonical, to_line
from dorothie_gym.sessions.event_lines import encode_event

if TYPE_CHECKING:
    from dorothie_gym.sessions.session import Session


def digest_of(session: Session) -> str:
    """Returns the SHA-256 of a session's content: header, outcome, events, decisions and every number of its frames.

    Its name, its pictures and the report of its reader do not count.
    """
    content = hashlib.sha256()

    def take(name: str, data: bytes) -> None:
        content.update(f"{name}:{len(data)}\n".encode())
        content.update(data)

    take("header", to_line(session.header.to_json()).encode())
    take("outcome", to_line(canonical(session.summary if session.complete else None, "outcome")).encode())
    take("events", "\n".join(encode_event(event, check=False) for event in session.events).encode())
    if session.decisions is not None:
        take("decisions", "\n".join(map(encode_decision, session.decisions)).encode())
    for name in session.trajectory.dtype.names or ():
        take(name, _bytes(session.trajectory[name]))
    scene = session.scene
    for name, table in (("actors", scene.actors), ("lights", scene.lights), ("weather", scene.weather)):
        take(f"{name} frames", _bytes(table.frames))
        take(f"{name} offsets", _bytes(table.offsets))
        for column in table.rows.dtype.names or ():
            take(f"{name} {column}", _bytes(table.rows[column]))
    for name in sorted(scene.columns):
        take(f"column {name}", _bytes(scene.columns[name]))
    return content.hexdigest()


def _bytes(values: NDArray[Any]) -> bytes:
    if values.dtype.kind not in "biuf":
        return to_line(canonical(values.tolist(), "column")).encode()
    if values.dtype.kind == "f":
        values = np.where(np.isnan(values), np.nan, values)  # one pattern of bits for what is not known
    return np.ascontiguousarray(values.astype(values.dtype.newbyteorder("<"))).tobytes()
