"""A new sensor fault: switched on by the Ad-Wizard, felt by the car, drawn and spoken of."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changes.working_copy import Edit, WorkingCopy, follow, listed_files

FAULTS = "dorothie_gym/pictures/camera/sensor_faults.py"

EDITS = (
    Edit(
        "dorothie_gym/ontology/world_exceptions.py",
        '    VIEW = "view"\n',
        '    VIEW = "view"\n    GLARE = "glare"\n',
    ),
    Edit(
        "dorothie_gym/sim/sensing/visibility.py",
        "Sensor.VIEW: 0.0}, Sensor",
        "Sensor.VIEW: 0.0, Sensor.GLARE: 0.5}, Sensor",
        r"CLARITY of dorothie_gym/sim/sensing/visibility\.py .* Sensor\.GLARE",
    ),
    Edit(
        "dorothie_gym/dialogue/data/talk/36_surroundings.talk",
        "== Explain co_wizard topic=failed_view\n",
        "== Explain co_wizard topic=failed_glare\nthe sun blinds my camera\n== Explain co_wizard topic=failed_view\n",
        r"dorothie_gym/dialogue/data/talk: there is no section `== Explain topic=failed_glare`",
    ),
    Edit(
        FAULTS,
        "Sensor.VIEW: _black_out}",
        "Sensor.VIEW: _black_out, Sensor.GLARE: _whiten}",
        r"_CHANGES of dorothie_gym/pictures/camera/sensor_faults\.py .* Sensor\.GLARE",
    ),
    Edit(
        FAULTS,
        "def _black_out(",
        "def _whiten(picture: NDArray[np.uint8], scratch: NDArray[np.uint8]) -> None:\n"
        "    picture[:] = 128 + picture // 2\n\n\ndef _black_out(",
        r"NameError: name '_whiten'",
    ),
)

PROBE = """
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.dialogue.grammar import load_grammar
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind, Sensor
from dorothie_gym.session.spaces.actions import AdWizardAction, noop

engine = SessionEngine("brookside")
engine.reset(seed=1)
load_grammar()
world = engine.session.world
clear = world.sight
glare = AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=Sensor.GLARE, on=True)
idle = {str(role): noop(role, engine.limits) for role in AGENT_ROLES}
engine.step({**idle, "ad_wizard": glare.encode(engine.limits)})
assert not engine.session.log.refused[Role.AD_WIZARD]
assert world.sight < 0.8 * clear, (world.sight, clear)
assert engine.observations["ad_wizard"]["sensors"].tolist() == [0, 0, 0, 1]

from dorothie_gym.lab.console.vocabulary import vocabulary
from dorothie_gym.pictures.camera import camera_of
from dorothie_gym.session.config import CameraConfig
camera = camera_of(engine.town, engine.scenario, CameraConfig(width=160, height=96))
assert camera.render(world).rgb.min() >= 128
assert vocabulary()["sensors"][-1] == "glare"
"""


@pytest.mark.slow
def test_following_the_page_adds_a_sensor_fault(tmp_path: Path) -> None:
    follow(WorkingCopy(tmp_path), EDITS, PROBE)


def test_page_lists_the_files_for_a_sensor_fault() -> None:
    assert list(dict.fromkeys(edit.file for edit in EDITS)) == listed_files("A sensor fault")[:4]


def test_first_error_names_the_effect_of_a_fault(tmp_path: Path) -> None:
    copy = WorkingCopy(tmp_path)
    copy.edit(EDITS[0])
    error = copy.first_error("import dorothie_gym.sim.world")
    assert "CLARITY of dorothie_gym/sim/sensing/visibility.py" in error and "Sensor.GLARE" in error
