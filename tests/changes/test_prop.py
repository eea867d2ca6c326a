"""A new prop: placed, named and drawn, at first as a plain box."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changes.working_copy import Edit, WorkingCopy, follow, listed_files

PROPS = "dorothie_gym/pictures/camera/models/props.py"

EDITS = (
    Edit(
        "dorothie_gym/ontology/world_exceptions.py",
        '    TRAFFIC_SIGN = "trafficsign", 0.10, 0.76, 2.89\n',
        '    TRAFFIC_SIGN = "trafficsign", 0.10, 0.76, 2.89\n    BENCH = "bench", 0.40, 0.40, 0.85\n',
    ),
    Edit(
        "dorothie_gym/ontology/world_exceptions.py",
        '"bench", 0.40, 0.40, 0.85\n',
        '"bench", 0.55, 1.80, 0.85\n',
        r"PropKind of dorothie_gym/ontology/world_exceptions\.py: CONSTRUCTION_CONE has .* of BENCH;",
    ),
    Edit(
        "dorothie_gym/dialogue/data/talk/36_surroundings.talk",
        "== prop trafficsign\n",
        "== prop bench\na bench *2 | a park bench\n== prop trafficsign\n",
        r"dorothie_gym/dialogue/data/talk: there is no section `== prop bench`",
    ),
    Edit(
        PROPS,
        "        PropKind.TRAFFIC_SIGN: _sign,\n",
        "        PropKind.TRAFFIC_SIGN: _sign,\n        PropKind.BENCH: _bench,\n",
        r"^one warning: prop bench: .* plain box; .* _FORMS of dorothie_gym/pictures/camera/models/props\.py",
    ),
    Edit(
        PROPS,
        "def _sign(model",
        "def _bench(model: ModelBuilder, kind: PropKind) -> None:\n"
        "    half, side = kind.length / 2.0, kind.width / 2.0\n"
        "    model.box((-half, -side, 0.4), (half, side, 0.46), Part.TROUSERS)\n"
        "    model.box((half - 0.08, -side, 0.46), (half, side, kind.height), Part.TROUSERS)\n\n\n"
        "def _sign(model",
        r"NameError: name '_bench'",
    ),
)

PROBE = """
import warnings
from dorothie_gym.dialogue.grammar import load_grammar
from dorothie_gym.ontology.world_exceptions import PropKind
from dorothie_gym.pictures.camera import camera_of
from dorothie_gym.session.config import CameraConfig
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig

load_grammar()
engine = SessionEngine("brookside", config=EnvConfig(world=WorldConfig(vehicles=0, pedestrians=0)))
engine.reset(seed=1)
world = engine.session.world
with warnings.catch_warnings(record=True) as warned:
    warnings.simplefilter("always", UserWarning)
    camera = camera_of(engine.town, engine.scenario, CameraConfig(width=160, height=96))
road = camera.render(world).rgb.copy()
world.actors.add_prop(PropKind.BENCH, world.planner.lane, world.planner.station + 9.0)
with_prop = camera.render(world).rgb
changed = (with_prop != road).any(axis=-1)
assert 20 < changed.sum() < changed.size // 4, f"the prop covers {changed.sum()} pixels"
camera_of(engine.town, engine.scenario, CameraConfig(width=160, height=96))  # warns only once
print(int(changed.sum()))
if warned:
    (warning,) = warned
    raise SystemExit(f"one warning: {warning.message}")
"""


@pytest.mark.slow
def test_following_the_page_adds_a_prop(tmp_path: Path) -> None:
    follow(WorkingCopy(tmp_path), EDITS, PROBE)


def test_page_lists_the_files_for_a_prop() -> None:
    assert list(dict.fromkeys(edit.file for edit in EDITS)) == listed_files("A prop")[:3]


def test_first_error_names_the_words_of_a_prop(tmp_path: Path) -> None:
    copy = WorkingCopy(tmp_path)
    copy.edit(EDITS[0])
    error = copy.first_error("from dorothie_gym.dialogue.grammar import load_grammar; load_grammar()")
    assert "dorothie_gym/dialogue/data/talk: there is no section `== prop bench`" in error
