"""A new kind of exception: feasible in the mask, executed, logged and put into words."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changes.working_copy import Edit, WorkingCopy, follow, listed_files

EXECUTOR = "dorothie_gym/session/exception_executor.py"

EDITS = (
    Edit(
        "dorothie_gym/ontology/world_exceptions.py",
        '    MESSAGE = 11, "Message"\n',
        '    MESSAGE = 11, "Message"\n    POWER_FAILURE = 12, "PowerFailure"\n',
    ),
    Edit(
        EXECUTOR,
        "        ExceptionKind.MESSAGE: ExceptionExecutor._message,\n",
        "        ExceptionKind.MESSAGE: ExceptionExecutor._message,\n"
        "        ExceptionKind.POWER_FAILURE: ExceptionExecutor._power_failure,\n",
        r"HANDLERS of dorothie_gym/session/exception_executor\.py .* ExceptionKind\.POWER_FAILURE",
    ),
    Edit(
        EXECUTOR,
        "    # --- task ---",
        "    def _power_failure(self, action: AdWizardAction) -> Outcome:\n"
        "        working = [sensor for sensor in Sensor if sensor not in self._world.faults]\n"
        "        for sensor in working:\n"
        "            self._world.set_fault(sensor, True)\n"
        '        return {"sensors": len(working)} if working else "no sensor works"\n\n'
        "    # --- task ---",
        r"AttributeError: .*_power_failure",
    ),
    Edit(
        EXECUTOR,
        "import ExceptionKind, PropKind\n",
        "import ExceptionKind, PropKind, Sensor\n",
    ),
    Edit(
        "dorothie_gym/session/observations.py",
        "        ExceptionKind.MESSAGE: lambda task, props: True,\n",
        "        ExceptionKind.MESSAGE: lambda task, props: True,\n"
        "        ExceptionKind.POWER_FAILURE: lambda task, props: True,\n",
        r"FEASIBLE of dorothie_gym/session/observations\.py .* ExceptionKind\.POWER_FAILURE",
    ),
    Edit(
        "dorothie_gym/pictures/views/exception_words.py",
        '    "weather": lambda',
        '    "power_failure": lambda data: f"{data[\'sensors\']} sensors fail",\n    "weather": lambda',
        r"AssertionError: power failure",
    ),
)

PROBE = """
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind, Sensor
from dorothie_gym.pictures.views.exception_words import exception_words
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import AdWizardAction, noop

engine = SessionEngine("brookside")
engine.reset(seed=1)
failure = AdWizardAction(exception=ExceptionKind.POWER_FAILURE)
idle = {str(role): noop(role, engine.limits) for role in AGENT_ROLES}
assert engine.mask(Role.AD_WIZARD)["exception"][12] == 1
engine.step({**idle, "ad_wizard": failure.encode(engine.limits)})
assert set(engine.session.world.faults) == set(Sensor)
words = exception_words({"kind": "power_failure", "sensors": 3})
assert words == "power failure: 3 sensors fail", words
"""


@pytest.mark.slow
def test_following_the_page_adds_a_kind_of_exception(tmp_path: Path) -> None:
    follow(WorkingCopy(tmp_path), EDITS, PROBE)


def test_page_lists_the_files_for_a_kind_of_exception() -> None:
    assert list(dict.fromkeys(edit.file for edit in EDITS)) == listed_files("A kind of exception")[:4]


@pytest.mark.long
def test_first_errors_name_the_execution_and_the_mask(tmp_path: Path) -> None:
    copy = WorkingCopy(tmp_path)
    copy.edit(EDITS[0])
    assert "ExceptionKind.POWER_FAILURE" in copy.first_error("import dorothie_gym.session.exception_executor")
    assert "ExceptionKind.POWER_FAILURE" in copy.first_error("import dorothie_gym.session.observations")
