"""A new reward term: of the sessions of three roles, and of the driving ids."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changes.working_copy import Edit, WorkingCopy, follow, listed_files

REWARDS = "dorothie_gym/session/rewards.py"

EDITS = (
    Edit(
        REWARDS,
        "    talk: float = -0.01\n",
        "    talk: float = -0.01\n    lights: float = 0.5\n",
    ),
    Edit(
        REWARDS,
        '"subgoal", "success", "collision", "time", "refusal", *(',
        '"subgoal", "success", "collision", "time", "refusal", "lights", *(',
        r"term_names of dorothie_gym/session/rewards\.py .* lacks lights",
    ),
    Edit(
        REWARDS,
        '                "refusal": self.refusal * refusals[role],\n',
        '                "refusal": self.refusal * refusals[role],\n'
        '                "lights": sign * self.lights * lights,\n',
        r"RewardWeights\.terms of dorothie_gym/session/rewards\.py .* lacks lights",
    ),
    Edit(
        REWARDS,
        "        spoken: Mapping[Role, bool],\n",
        "        spoken: Mapping[Role, bool],\n        lights: bool,\n",
        r"NameError: name 'lights'",
    ),
    Edit(
        "dorothie_gym/session/live_session.py",
        "            spoken=begun.spoken,\n",
        "            spoken=begun.spoken,\n            lights=self.world.ego.lights,\n",
        r"RewardWeights\.terms\(\) missing .* 'lights'",
    ),
)

PROBE = """
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import CoWizardAction, Physical, noop

engine = SessionEngine("brookside")
engine.reset(seed=1)
idle = {str(role): noop(role, engine.limits) for role in AGENT_ROLES}
assert engine.step(idle).reward_terms[Role.CO_WIZARD]["lights"] == 0.0
lights = CoWizardAction(physical=Physical(action=PhysicalAction.LIGHT_CHANGE, up=True)).encode(engine.limits)
terms = engine.step({**idle, "co_wizard": lights}).reward_terms
assert terms[Role.CO_WIZARD]["lights"] == 0.5 and terms[Role.AD_WIZARD]["lights"] == -0.5
assert engine.info(Role.CO_WIZARD, terms[Role.CO_WIZARD])["reward_terms"]["lights"] == 0.5
"""


@pytest.mark.slow
def test_following_the_page_adds_a_reward_term(tmp_path: Path) -> None:
    follow(WorkingCopy(tmp_path), EDITS, PROBE)


def test_page_lists_the_files_for_a_reward_term() -> None:
    assert list(dict.fromkeys(edit.file for edit in EDITS)) == listed_files("A reward term")[:2]


def test_weight_of_the_driving_ids_without_a_term_is_named(tmp_path: Path) -> None:
    copy = WorkingCopy(tmp_path)
    copy.edit(Edit(REWARDS, "    action: float = -0.005\n", "    action: float = -0.005\n    lights: float = 0.5\n"))
    error = copy.first_error("import dorothie_gym.session.rewards")
    assert "write_navigation_terms of dorothie_gym/session/rewards.py" in error
