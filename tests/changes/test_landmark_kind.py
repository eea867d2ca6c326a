"""A new landmark kind: described, spoken of and drawn, at first as a plain building."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changes.working_copy import Edit, WorkingCopy, follow, listed_files

DESIGNS = "dorothie_gym/tasks/landmark_designs.py"
SIGNS = "dorothie_gym/pictures/camera/atlas.py"

EDITS = (
    Edit(
        "dorothie_gym/ontology/slots.py",
        '    PERSON = 10, "Person"\n    QUERIED = 11, "Queried"\n',
        '    PERSON = 10, "Person"\n    QUERIED = 11, "Queried"\n    LIBRARY = 12, "Library"\n',
    ),
    Edit(
        "dorothie_gym/tasks/data/landmarks.yaml",
        "House:\n",
        "Library:\n  category: places.culture\n  label: Library\n  noun: library\n"
        "  attributes:\n    items: [a novel, an atlas]\nHouse:\n",
        r"dorothie_gym/tasks/data/landmarks\.yaml: describes no Library",
    ),
    Edit(
        "dorothie_gym/dialogue/data/lexicon.yaml",
        "  House: { say: [the house, the house]",
        "  Library: { say: [the library] }\n  House: { say: [the house, the house]",
        r"dorothie_gym/dialogue/data/lexicon\.yaml: Landmark\.Library is missing",
    ),
    Edit(
        DESIGNS,
        "        LandmarkName.SHELL: StoreDesign(",
        "        LandmarkName.LIBRARY: StoreDesign(Top.GABLE, (150, 60, 50), (40, 60, 120), (240, 240, 230)),\n"
        "        LandmarkName.SHELL: StoreDesign(",
        r"^one warning: landmark Library: .* plain building; .* STORES of dorothie_gym/tasks/landmark_designs\.py",
    ),
    Edit(
        SIGNS,
        '    LandmarkName.SHELL: (Texture.SHELL, "Shell"',
        '    LandmarkName.LIBRARY: (Texture.LIBRARY, "Library", (255, 255, 255), (40, 60, 120)),\n'
        '    LandmarkName.SHELL: (Texture.SHELL, "Shell"',
        r"BRAND_SIGNS of dorothie_gym/pictures/camera/atlas\.py .* LandmarkName\.LIBRARY",
    ),
    Edit(
        SIGNS,
        '    """Pictogram of a person."""\n',
        '    """Pictogram of a person."""\n    LIBRARY = 30\n',
        r"AttributeError: .*LIBRARY",
    ),
)

PROBE = """
import warnings
from dataclasses import replace
from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.tasks.catalogue import catalogue

assert catalogue()[LandmarkName.LIBRARY].noun == "library"
load_lexicon()
assert understand("take me to the library").landmarks == (LandmarkName.LIBRARY,)

from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig
from dorothie_gym.session.session_engine import SessionEngine

engine = SessionEngine("brookside")
observed = engine.reset(seed=1)
assert len(observed["co_wizard"]["guesses"]) == len(LandmarkName)
world, scene = engine.session.world, town_scene(engine.town)
library = replace(engine.scenario.storyboard.landmarks[0], name=LandmarkName.LIBRARY)
lot = scene.lots[library.site]
x, y = lot.at(-12.0, 0.0)

def picture(landmarks):
    camera = SessionCamera(SessionScene(scene, [], landmarks), CameraConfig(width=160, height=96))
    pose = camera.pose_on(x, y, float(world.car.height), lot.heading)
    return camera.render_from(pose, world.actors.arrays, world.weather, time=0.0).rgb.copy()

street = picture([])
with warnings.catch_warnings(record=True) as warned:
    warnings.simplefilter("always", UserWarning)
    changed = (picture([library]) != street).any(axis=-1).mean()
    picture([library])  # warns only once
assert changed > 0.05, f"the building covers {changed:.3f} of the picture"
if warned:
    (warning,) = warned
    raise SystemExit(f"one warning: {warning.message}")
"""


@pytest.mark.long
def test_following_the_page_adds_a_landmark_kind(tmp_path: Path) -> None:
    follow(WorkingCopy(tmp_path), EDITS, PROBE)


def test_page_lists_the_files_for_a_landmark_kind() -> None:
    assert list(dict.fromkeys(edit.file for edit in EDITS)) == listed_files("A landmark kind")[:5]


def test_first_error_names_the_data_file_of_landmarks(tmp_path: Path) -> None:
    copy = WorkingCopy(tmp_path)
    copy.edit(EDITS[0])
    error = copy.first_error("from dorothie_gym.tasks.catalogue import catalogue; catalogue()")
    assert "dorothie_gym/tasks/data/landmarks.yaml: describes no Library" in error
