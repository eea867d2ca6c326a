"""Picture of a whole session: start, direction, exceptions, deleted tasks, transcript, and pins beside the streets."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from dorothie_gym.maps import load_town, town_names
from dorothie_gym.ontology import AGENT_ROLES, ExceptionKind, Role
from dorothie_gym.pictures import MapPainter, palette
from dorothie_gym.pictures.maps.map_sheet import site_key
from dorothie_gym.pictures.views.aerial import AerialView
from dorothie_gym.pictures.views.frames import PICTURE_SIZE, SceneRenderer
from dorothie_gym.pictures.views.scene import ExceptionMark, Scene, SpokenLine
from dorothie_gym.pictures.views.session_scene import scene_of
from dorothie_gym.pictures.views.sprites import PIN_LENGTH, pin_direction
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import AdWizardAction, noop
from tests.pictures.views.test_frames import count, scene, town  # noqa: F401  # fixtures


@pytest.fixture(scope="module")
def whole() -> SceneRenderer:
    return SceneRenderer(PICTURE_SIZE, transcript=True)


def map_of(frame: Any) -> Any:
    return frame[:, : PICTURE_SIZE[0] - 801]


def test_start_direction_and_exceptions_are_marked(whole: SceneRenderer, scene: Scene) -> None:  # noqa: F811
    plain = whole.draw(dataclasses.replace(scene, trail=np.zeros((0, 2))), follow=False)
    driven = whole.draw(scene, follow=False)
    assert count(map_of(plain), palette.DIRECTION) == 0 < count(map_of(driven), palette.DIRECTION)
    mark = ExceptionMark(time=20.0, text="place prop: cones on the road", x=scene.trail[30, 0], y=scene.trail[30, 1])
    marked = whole.draw(dataclasses.replace(scene, exceptions=[mark]), follow=False)
    assert count(map_of(driven), palette.EXCEPTION) == 0 < count(map_of(marked), palette.EXCEPTION)
    assert count(marked[:, -800:], palette.EXCEPTION) > count(driven[:, -800:], palette.EXCEPTION)


def test_transcript_has_the_first_utterance_of_a_long_session(whole: SceneRenderer, scene: Scene) -> None:  # noqa: F811
    talk = [SpokenLine(time=4.0 * k, speaker=Role.CO_WIZARD, text=f"Number {k}, and a little more.") for k in range(70)]
    other = [dataclasses.replace(talk[0], text="Quite another text."), *talk[1:]]
    first, second = (whole.draw(dataclasses.replace(scene, utterances=lines), follow=False) for lines in (talk, other))
    assert not np.array_equal(first, second)


def test_transcript_that_is_too_long_keeps_its_end(whole: SceneRenderer, scene: Scene) -> None:  # noqa: F811
    talk = [SpokenLine(time=4.0 * k, speaker=Role.PARTICIPANT, text="Words and words. " * 12) for k in range(200)]
    other = [*talk[:-1], dataclasses.replace(talk[-1], text="The last.")]
    first, second = (whole.draw(dataclasses.replace(scene, utterances=lines), follow=False) for lines in (talk, other))
    assert not np.array_equal(first, second)


def test_deleted_tasks_stay_in_the_picture_and_exceptions_are_kept() -> None:
    engine = SessionEngine("brookside")
    for seed in range(50):
        engine.reset(seed=seed)
        task = engine.session.task
        if task.possible_deletions():
            break
    number = next(iter(task.possible_deletions()))
    text = task.description(number)
    actions = {str(role): noop(role, engine.limits) for role in AGENT_ROLES}
    deletion = AdWizardAction(exception=ExceptionKind.TASK_DELETE, item=number, message="Leave that.")
    engine.step({**actions, "ad_wizard": deletion.encode(engine.limits)})
    shown = scene_of(engine.session)
    assert (text, "abandoned") in shown.subgoals
    assert [mark.text.split(":")[0] for mark in shown.exceptions] == ["task delete"]


@pytest.mark.parametrize("name", town_names())
def test_no_pin_covers_the_name_of_a_street(name: str) -> None:
    view = AerialView((880, 800))
    painter = MapPainter(load_town(name), size=view.size, margin=(20, 40, 20, 52), type_sizes=(16, 11))
    for site in painter.town.sites:
        at = np.array(site.position)
        head = painter.to_pixel(at) + PIN_LENGTH * pin_direction(at, np.array(site.waypoint))
        own = [label for label in painter.labels if label.street == site.street]
        for label in own:
            gap = float(np.hypot(*(label.path - head).T).min())
            assert gap > 0.5 * label.size, (site.id, label.text)


@pytest.mark.parametrize("name", town_names())
def test_every_numbered_site_is_in_the_key_of_the_sheet(name: str) -> None:
    made = load_town(name)
    names = [street.name for street in made.streets]
    lines = site_key(made, names, 12.0, 1300.0)
    listed: list[int] = []
    for entry in " ".join(lines).removeprefix("Landmark sites:").split("·"):
        street = max((each for each in names if entry.strip().endswith(f" {each}")), key=len)
        for part in entry.strip().removesuffix(street).strip().split(", "):
            first, _, last = part.partition("–")
            listed += range(int(first), int(last or first) + 1)
            assert all(names[made.sites[k - 1].street] == street for k in range(int(first), int(last or first) + 1))
    assert sorted(listed) == [site.id + 1 for site in made.sites]
