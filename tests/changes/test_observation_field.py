"""A new field of the Co-Wizard's observation, which compiled code writes at every decision."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changes.working_copy import Edit, WorkingCopy, follow, listed_files

EDITS = (
    Edit(
        "dorothie_gym/session/spaces/observations.py",
        '        real("cruise_speed", 1, unit="km/h", meaning="speed set by the Co-Wizard"),\n',
        '        real("cruise_speed", 1, unit="km/h", meaning="speed set by the Co-Wizard"),\n'
        '        real("progress", 1, unit="m", meaning="distance covered on the planned path"),\n',
    ),
    Edit(
        "dorothie_gym/session/view_arrays.py",
        "    cruise_speed: Array\n",
        "    cruise_speed: Array\n    progress: Array\n",
        r"AssertionError: nothing has written it",
    ),
    Edit(
        "dorothie_gym/session/view_steps.py",
        "    views.hazard[number] = control.hazard\n",
        "    views.hazard[number] = control.hazard\n    views.progress[number, 0] = control.s\n",
    ),
)

PROBE = """
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import noop

engine = SessionEngine("brookside")
engine.reset(seed=1)
idle = {str(role): noop(role, engine.limits) for role in AGENT_ROLES}
for _ in range(12):
    engine.step(idle)
assert engine.observations["co_wizard"]["progress"].shape == (1,)
assert engine.observations["co_wizard"]["progress"][0] > 0.0, "nothing has written it"
assert "progress" not in engine.observations["participant"]
"""


@pytest.mark.slow
def test_following_the_page_adds_a_field(tmp_path: Path) -> None:
    follow(WorkingCopy(tmp_path), EDITS, PROBE)


def test_page_lists_the_files_for_a_field() -> None:
    assert [edit.file for edit in EDITS] == listed_files("A field of an observation")[:3]
