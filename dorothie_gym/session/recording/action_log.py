"""Log of the roles' actions (`actions.jsonl`), from which a session can be simulated again."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.recording.files import (
    ACTIONS_FILE,
    MAX_EVENTS,
    MAX_FRAME,
    Fields,
    canonical,
    from_line,
    read_lines,
    to_line,
)

_ROLES: Final = {role.value: role for role in AGENT_ROLES}


@dataclass(frozen=True, kw_only=True)
class Decision:
    """Actions of the roles at a decision.

    Attributes:
        frame: frame of the decision; the actions take effect in the next frame.
        actions: by role, the fields of its action that differ from those of the no-op action (JSON types).
            Arrays of 0 and 1 are stored as the indices of the ones, other arrays as numbers without trailing zeros.
            Roles with a no-op action are left out.
    """

    frame: int
    actions: Mapping[Role, Mapping[str, object]]


def encode_decision(decision: Decision) -> str:
    """Returns the decision as JSON on one line; raises `SessionError` if an action holds other types than JSON's."""
    where = f"decision at frame {decision.frame}"
    if not 0 <= decision.frame < MAX_FRAME:
        raise SessionError(f"{where}: frames are in 0..{MAX_FRAME - 1}")
    actions = {
        role.value: canonical(decision.actions[role], f"{where}: {role}")
        for role in AGENT_ROLES
        if role in decision.actions
    }
    return to_line({"frame": canonical(decision.frame, where), **actions})


def decode_decision(line: str, where: str) -> Decision:
    """Returns the decision of a line; raises `SessionError` with `where` and the field if it is malformed."""
    fields = Fields(from_line(line, where), where)
    frame = fields.integer("frame", 0)
    if frame >= MAX_FRAME:
        raise fields.error("frame", f"below {MAX_FRAME}")
    actions = {}
    for name in fields.others(("frame",)):
        if name not in _ROLES:
            raise SessionError(f"{where}: field {name!r} is none of {', '.join(_ROLES)}")
        actions[_ROLES[name]] = fields.mapping(name)
    return Decision(frame=frame, actions=actions)


def read_decisions(folder: Path) -> tuple[tuple[Decision, ...] | None, bool]:
    """Returns the decisions of a session, and whether the last line is torn.

    Returns:
        The decisions, in order of frames; None if they were not recorded.

    Raises:
        SessionError: a line is damaged, or the frames do not rise.
    """
    path = folder / ACTIONS_FILE
    if not path.exists():
        return None, False
    lines, torn = read_lines(path, MAX_EVENTS)
    decisions = tuple(decode_decision(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1))
    check_order(decisions, str(path))
    return decisions, torn


def check_order(decisions: Sequence[Decision], where: str) -> None:
    """Raises `SessionError`, prefixed with `where`, if the frames of decisions do not rise."""
    for number, (before, after) in enumerate(itertools.pairwise(decisions), start=2):
        if after.frame <= before.frame:
            raise SessionError(f"{where}, line {number}: frame {after.frame} after {before.frame}; frames must rise")
