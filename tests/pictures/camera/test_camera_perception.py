"""Sessions whose roles see what the picture of the car's camera shows, and nothing else."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import numpy as np
import pytest

from dorothie_gym import DuoWizardEnv, EnvConfig
from dorothie_gym.envs.duo_wizard_vector_env import DuoWizardVectorEnv
from dorothie_gym.evaluation.rollout.replay import config_of
from dorothie_gym.ontology import AGENT_ROLES, Role, Sensor, WeatherParameter
from dorothie_gym.pictures.camera.scenery.landmarks import landmark_key
from dorothie_gym.pictures.camera.visibility import BODY_PIXELS, LANDMARK_PIXELS, is_body_seen, is_landmark_recognised
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.observation_parser import nearest_landmark, read_landmarks
from dorothie_gym.session.config import PerceptionModel
from dorothie_gym.session.recording.files import to_page
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import LandmarkColumn, ObjectColumn, Observation, noop
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.sensing.visibility import CLEAR_SIGHT
from dorothie_gym.testing.playing import first_unequal

BUSY = WorldConfig(vehicles=50, pedestrians=50)
CONFIG = EnvConfig(perception=PerceptionModel.CAMERA, world=BUSY)
SYMBOLIC = EnvConfig(world=BUSY)
TOWN = "brookside"


def played(engine: SessionEngine, *, seed: int, decisions: int) -> Iterator[dict[str, Observation]]:
    """Plays a session with the scripted policies; yields the observations before each decision."""
    engine.reset(seed)
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    states = {role: policy.initial_state(seed, engine.town) for role, policy in policies.items()}
    for _ in range(decisions):
        observations = dict(engine.observations)
        yield observations
        actions = {}
        for role, policy in policies.items():
            actions[str(role)], states[role] = policy.step(observations[str(role)], states[role])
        engine.step(actions)
        if engine.over:
            return


def used(table: np.ndarray) -> np.ndarray:
    """Returns the rows of a table that are used."""
    return table[table[:, 0] > 0]


def idle(engine: SessionEngine, decisions: int = 1) -> dict[str, Observation]:
    """Plays decisions without actions; returns the observations behind them."""
    for _ in range(decisions):
        engine.step({str(role): noop(role, engine.limits) for role in AGENT_ROLES})
    return dict(engine.observations)


def test_a_body_needs_more_pixels_where_less_contrast_is_left() -> None:
    assert is_body_seen(BODY_PIXELS, 1.0)
    assert not is_body_seen(BODY_PIXELS - 1, 1.0)
    assert not is_body_seen(BODY_PIXELS, 0.5)
    assert is_body_seen(2 * BODY_PIXELS, 0.5)
    assert not is_body_seen(480 * 320, 0.0)
    assert is_landmark_recognised(LANDMARK_PIXELS, 1.0)
    assert not is_landmark_recognised(LANDMARK_PIXELS, 0.9)


def test_objects_are_those_of_the_symbolic_model_that_are_in_front_and_not_hidden() -> None:
    engine = SessionEngine(TOWN, config=CONFIG)
    shown = everything = 0
    for observations in played(engine, seed=3, decisions=60):
        seen = {tuple(row) for row in used(observations["participant"]["objects"])}
        world = engine.session.world
        near = {(row[1], row[2], row[3]) for row in world.seen().tolist()}  # kind and place, of a clear day
        assert {(row[0], row[1], row[2]) for row in seen} <= near
        for row in seen:
            half = 0.5 * np.hypot(row[ObjectColumn.LENGTH], row[ObjectColumn.WIDTH]) + 0.35  # and the camera's offset
            beside = np.arctan2(half, row[ObjectColumn.DISTANCE])
            assert abs(row[ObjectColumn.BEARING]) <= np.pi / 4 + beside  # half the field of view
            assert row[ObjectColumn.DISTANCE] <= CLEAR_SIGHT
        distances = used(observations["participant"]["objects"])[:, ObjectColumn.DISTANCE]
        assert (np.diff(distances) >= 0.0).all()
        shown, everything = shown + len(seen), everything + len(near)
    assert 20 < shown < 0.6 * everything


def test_every_object_has_its_pixels_and_every_body_with_pixels_is_an_object() -> None:
    engine = SessionEngine(TOWN, config=CONFIG)
    for observations in played(engine, seed=5, decisions=40):
        perception, world = engine.session.observer.camera_perception, engine.session.world
        assert perception is not None
        expected = [row for row in world.seen().tolist() if perception.pixels(int(row[0])) >= BODY_PIXELS]
        table = used(observations["participant"]["objects"])
        np.testing.assert_allclose(table[:, ObjectColumn.X : ObjectColumn.Y + 1], [row[2:4] for row in expected])


def test_the_co_wizard_sees_the_same_objects_around_its_estimated_pose() -> None:
    engine = SessionEngine(TOWN, config=CONFIG)
    compared = 0
    for observations in played(engine, seed=3, decisions=40):
        own, other = (used(observations[agent]["objects"]) for agent in ("participant", "co_wizard"))
        unplaced = [ObjectColumn.KIND, ObjectColumn.DISTANCE, ObjectColumn.BEARING, ObjectColumn.SPEED]
        np.testing.assert_array_equal(own[:, unplaced], other[:, unplaced])
        pose, truth = observations["co_wizard"]["pose"], observations["participant"]["pose"]
        away = np.hypot(*(other[:, 1:3] - pose[:2]).T) - np.hypot(*(own[:, 1:3] - truth[:2]).T)
        np.testing.assert_allclose(away, 0.0, atol=1e-9)
        compared += len(own)
    assert compared > 20


def test_a_covered_view_shows_nothing_and_the_car_still_brakes_for_hazards() -> None:
    engine = SessionEngine(TOWN, config=CONFIG)
    for _ in played(engine, seed=0, decisions=8):
        pass
    world = engine.session.world
    world.faults[Sensor.VIEW] = world.frame + 3000
    observations = idle(engine)
    assert not observations["participant"]["objects"].any()
    assert not observations["participant"]["landmarks_in_view"].any()
    assert len(world.seen())  # by radar and beyond


def test_fog_hides_distant_bodies() -> None:
    clear, foggy = 0.0, 0.0
    for seed in (3, 4, 5):
        engine = SessionEngine(TOWN, config=CONFIG)
        for observations in played(engine, seed=seed, decisions=20):
            table = used(observations["participant"]["objects"])
            clear = max(clear, *table[:, ObjectColumn.DISTANCE], 0.0)
        engine.session.world.weather.set(WeatherParameter.FOG_DENSITY, 90.0)
        for _ in range(20):
            table = used(idle(engine)["participant"]["objects"])
            foggy = max(foggy, *table[:, ObjectColumn.DISTANCE], 0.0)
    assert foggy < 45.0 < clear


def test_a_hidden_landmark_is_observed_from_the_first_time_that_it_is_in_view() -> None:
    met = 0
    for seed in (9, 13, 30, 32):
        engine = SessionEngine(TOWN, config=CONFIG)
        first: dict[int, int] = {}
        for k, observations in enumerate(played(engine, seed=seed, decisions=56)):
            landmarks = engine.scenario.storyboard.landmarks
            hidden = [landmark for landmark in landmarks if landmark.hidden]
            perception = engine.session.observer.camera_perception
            assert perception is not None
            enough = [
                landmark.index
                for landmark in landmarks
                if perception.pixels(landmark_key(landmark.index)) >= LANDMARK_PIXELS
            ]
            assert set(perception.in_view) <= set(enough)
            if engine.session.world.visibility.transmission(CLEAR_SIGHT) == 1.0:
                assert list(perception.in_view) == enough
            for landmark in hidden:
                if landmark.index in perception.in_view:
                    first.setdefault(landmark.index, k)
            known = used(observations["co_wizard"]["landmarks"])
            places = {tuple(row[1:3]) for row in known}
            for landmark in hidden:
                assert (landmark.position in places) == (landmark.index in first)
            for row, flag in zip(known, observations["co_wizard"]["landmarks_in_view"], strict=False):
                place = tuple(row[LandmarkColumn.X : LandmarkColumn.Y + 1])
                index = next(landmark.index for landmark in landmarks if landmark.position == place)
                assert flag == (index in perception.in_view)
            flags = observations["participant"]["landmarks_in_view"]
            assert set(np.flatnonzero(flags)) == set(perception.in_view)
        met += len(first)
    assert met >= 3


def test_words_refer_to_landmarks_in_view_only() -> None:
    engine = SessionEngine(TOWN, config=CONFIG)
    referred = 0
    for observations in played(engine, seed=1, decisions=200):
        observation = observations["participant"]
        marks = read_landmarks(observation, engine.town)
        near = nearest_landmark(observation, marks, *observation["pose"][:2])
        if near is not None:
            referred += 1
            assert observation["landmarks_in_view"][near.row]
        without = {name: value for name, value in observation.items() if name != "landmarks_in_view"}
        usual = nearest_landmark(without, marks, *observation["pose"][:2])
        assert near is None or usual is not None
    assert referred


def test_observations_are_in_their_spaces_and_symbolic_ones_stay_as_they_were() -> None:
    engine, usual = SessionEngine(TOWN, config=CONFIG), SessionEngine(TOWN, config=SYMBOLIC)
    for each in (engine, usual):
        each.reset(2)
        idle(each, 3)
    for role in (Role.PARTICIPANT, Role.CO_WIZARD):
        observation = engine.observations[str(role)]
        assert engine.observation_space(role).contains(observation)
        assert set(observation) - set(usual.observations[str(role)]) == {"landmarks_in_view"}
    assert first_unequal(engine.observations["ad_wizard"], usual.observations["ad_wizard"]) is None
    assert "landmarks_in_view" not in usual.observation_space(Role.PARTICIPANT).spaces


def test_observing_changes_nothing_and_copies_go_on_alike() -> None:
    watched, unwatched = (SessionEngine(TOWN, config=CONFIG) for _ in range(2))
    for each in (watched, unwatched):
        each.reset(4)
    for _ in range(30):
        for each in (watched, unwatched):
            each.step({str(role): noop(role, each.limits) for role in AGENT_ROLES})
        dict(watched.observations)
    copy, state = deepcopy(watched), watched.clone_state()
    expected = [idle(unwatched) for _ in range(5)]
    for each in (watched, copy):
        assert first_unequal([idle(each) for _ in range(5)], expected) is None
    watched.restore_state(state)
    assert first_unequal([idle(watched) for _ in range(5)], expected) is None


PROGRAM = """
import hashlib
from tests.pictures.camera.test_camera_perception import CONFIG, TOWN, played
from dorothie_gym.session.session_engine import SessionEngine
found = hashlib.sha256()
for observations in played(SessionEngine(TOWN, config=CONFIG), seed=6, decisions=40):
    for agent in ("participant", "co_wizard"):
        for field in ("objects", "landmarks", "landmarks_in_view"):
            found.update(observations[agent][field].tobytes())
print(found.hexdigest())
"""


@pytest.mark.long
def test_two_processes_observe_the_same_bytes() -> None:
    runs = [subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True) for _ in "ab"]
    assert runs[0].stdout == runs[1].stdout
    assert len(runs[0].stdout.strip()) == 64


def test_the_model_is_part_of_the_record_unless_it_is_the_usual_one() -> None:
    engine = SessionEngine(TOWN, config=CONFIG)
    engine.reset(0)
    header = engine.session_header()
    assert header.config["perception"] == "camera"
    assert config_of(header) == CONFIG
    assert '"perception": "camera"' in to_page(dict(header.config))
    assert "perception" not in SYMBOLIC.record()


@pytest.mark.long
def test_a_session_without_it_does_not_import_the_camera() -> None:
    program = (
        "import sys; from dorothie_gym.session.session_engine import SessionEngine; e = SessionEngine('brookside');"
        "e.reset(0); dict(e.observations); print('dorothie_gym.pictures.camera.session_camera' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


@pytest.mark.parametrize("value", ["eyes", None, 3])
def test_other_models_are_refused(value: Any) -> None:
    with pytest.raises(ValueError, match=r"EnvConfig\.perception is .*; it must be symbolic or camera"):
        EnvConfig(perception=value)


def test_batches_refuse_it() -> None:
    with pytest.raises(ValueError, match=r'config\.perception is "camera"; batches do not perceive by it'):
        DuoWizardVectorEnv(2, "brookside", config=CONFIG)


def test_environments_take_it_by_name() -> None:
    env = DuoWizardEnv(TOWN, config=EnvConfig(perception="camera"))  # type: ignore[arg-type]  # as in a notebook
    observations, _ = env.reset(seed=1)
    for agent in env.possible_agents:
        assert env.observation_space(agent).contains(observations[agent])


@pytest.mark.long
def test_the_co_wizard_drives_by_itself_to_a_goal_that_it_recognises() -> None:
    engine, taken = SessionEngine(TOWN, config=EnvConfig(perception=PerceptionModel.CAMERA)), 0
    engine.reset(5)
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    states: dict[Role, Any] = {role: policy.initial_state(5, engine.town) for role, policy in policies.items()}
    while not engine.over:
        hidden = {mark.position for mark in engine.scenario.storyboard.landmarks if mark.hidden}
        actions, observation = {}, dict(engine.observations)
        before = states[Role.CO_WIZARD].beliefs
        for role, policy in policies.items():
            actions[str(role)], states[role] = policy.step(observation[str(role)], states[role])
        after = states[Role.CO_WIZARD].beliefs
        if after.exact and not before.exact and after.goal is before.goal:
            marks = read_landmarks(observation["co_wizard"], engine.town)
            (goal,) = (mark for mark in marks if mark.place == after.place)
            assert observation["co_wizard"]["landmarks_in_view"][goal.row]
            assert (goal.x, goal.y) in hidden
            taken += 1
        engine.step(actions)
    assert taken
    assert engine.summary()["success"]
