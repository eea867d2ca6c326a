from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.archive import first_difference
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout import play_session, resimulate
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recorder import SessionRecorder, idle_actions
from dorothie_gym.session.recording import Decision, EndReason, Session, SessionWriter
from dorothie_gym.session.scenario import ReferenceDrive, draw_scenario, recorded_reference
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.time_allowed import reference_seconds
from dorothie_gym.tasks import StoryboardSource
from dorothie_gym.wrappers.record_session import RecordSession

TOWN = load_town("brookside")


def played(folder: Path, name: str = "scripted", **arguments: object) -> Session:
    env = DuoWizardEnv("brookside", **{"config": EnvConfig(max_seconds=40.0), **arguments})  # type: ignore[arg-type]  # arguments of several types
    policies = {role: make_policy(name, role, env.limits) for role in AGENT_ROLES}
    play_session(env, policies, seed=3, folder=folder)
    return Session.load(folder)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Session:
    return played(tmp_path_factory.mktemp("recorded") / "one")


@pytest.mark.parametrize("arguments", [{}, {"storyboard": "poorly_cat"}, {"max_cycles": 50}])
@pytest.mark.parametrize("name", ["scripted", "random"])
def test_session_comes_out_the_same_again(tmp_path: Path, name: str, arguments: dict[str, object]) -> None:
    session = played(tmp_path / "one", name, **arguments)
    again = resimulate(session, TOWN)
    assert first_difference(session, again) is None
    assert again.digest == session.digest and again.complete


def test_wrapper_records_what_is_needed_to_play_it_again(tmp_path: Path) -> None:
    env = RecordSession(DuoWizardEnv("brookside", max_cycles=30), tmp_path)
    env.reset(seed=4)
    for agent in env.possible_agents:
        env.action_space(agent).seed(1)
    while env.agents:
        env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    session = Session.load(tmp_path / "seed_4")
    assert len(session.decisions or ()) == 30
    assert len(session.scene.actors) == len(session.scene.lights) == len(session.scene.weather) == 30
    assert resimulate(session, TOWN).digest == session.digest


def test_interrupted_session_is_checked_up_to_its_last_frame(tmp_path: Path) -> None:
    def stop(env: DuoWizardEnv) -> None:
        if env.session.world.frame == 300:
            raise KeyboardInterrupt

    env = DuoWizardEnv("brookside")
    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    with pytest.raises(KeyboardInterrupt):
        play_session(env, policies, seed=3, folder=tmp_path, on_step=stop)
    session = Session.load(tmp_path)
    assert not session.complete
    assert first_difference(session, resimulate(session, TOWN)) is None


def test_time_that_depends_on_the_reference_is_that_of_the_record(tmp_path: Path) -> None:
    scenario = draw_scenario(TOWN, None, 3)
    reference = ReferenceDrive(seconds=9.0 * reference_seconds(TOWN, scenario), exchanges=5, subgoals=3)
    engine = SessionEngine(TOWN, config=EnvConfig(time_factor=0.1))

    def stop(engine: SessionEngine) -> None:
        if engine.session.world.time > 0.15 * reference_seconds(TOWN, scenario):
            raise KeyboardInterrupt

    policies = {role: make_policy("silent", role, engine.limits) for role in AGENT_ROLES}
    measured = dataclasses.replace(scenario, reference=reference)
    with pytest.raises(KeyboardInterrupt):
        play_session(engine, policies, seed=3, folder=tmp_path, on_step=stop, scenario=measured)
    session = Session.load(tmp_path)
    assert recorded_reference(session.header) == reference
    assert first_difference(session, resimulate(session, TOWN)) is None


@pytest.mark.parametrize("storyboard", [None, "generated:7"])
def test_a_session_with_a_generated_storyboard_is_replayed_from_its_header(
    storyboard: str | None, tmp_path: Path
) -> None:
    engine = SessionEngine(TOWN, storyboard, config=EnvConfig(max_seconds=15.0, storyboards=StoryboardSource.GENERATED))
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    play_session(engine, policies, seed=3, folder=tmp_path)
    session = Session.load(tmp_path)
    assert session.header.storyboard.startswith("generated:")
    assert (session.header.storyboard == "generated:7") is (storyboard is not None)
    assert first_difference(session, resimulate(session, TOWN)) is None


def test_damaged_reference_is_refused_by_its_field(recorded: Session) -> None:
    for page in ({"seconds": -1.0, "exchanges": 1, "subgoals": 1}, {"seconds": 1.0}, 5):
        header = dataclasses.replace(recorded.header, extra={"reference": page})
        with pytest.raises(SessionError, match="header, reference"):
            resimulate(dataclasses.replace(recorded, header=header), TOWN)


def test_other_action_is_found_at_the_frame_after_it(recorded: Session) -> None:
    assert recorded.decisions
    spoken = next(d for d in recorded.decisions if "utterance" in d.actions.get(Role.PARTICIPANT, {}))
    said = {**spoken.actions, Role.PARTICIPANT: {**spoken.actions[Role.PARTICIPANT], "utterance": "something else"}}
    others = tuple(Decision(frame=d.frame, actions=said) if d is spoken else d for d in recorded.decisions)
    changed = dataclasses.replace(recorded, decisions=others)
    difference = first_difference(changed, resimulate(changed, TOWN))
    assert difference is not None and difference.frame >= spoken.frame and "events" in difference.field


def test_last_bit_of_one_number_is_found(recorded: Session) -> None:
    again = resimulate(recorded, TOWN)
    trajectory = recorded.trajectory.copy()
    trajectory["y"][500] = np.nextafter(trajectory["y"][500], np.inf)
    difference = first_difference(dataclasses.replace(recorded, trajectory=trajectory), again)
    assert difference is not None
    assert (difference.frame, difference.field) == (int(trajectory["frame"][500]), "frames.y")
    actors = recorded.scene.actors
    rows = actors.rows.copy()
    rows["speed"][actors.offsets[7]] += 1.0
    scene = dataclasses.replace(recorded.scene, actors=dataclasses.replace(actors, rows=rows))
    difference = first_difference(dataclasses.replace(recorded, scene=scene), again)
    assert difference is not None and difference.frame == int(actors.frames[7])
    assert difference.field == f"actors.speed of number {rows['key'][actors.offsets[7]]}"


def test_event_that_is_missing_and_another_outcome_are_found(recorded: Session) -> None:
    shorter = dataclasses.replace(recorded, events=recorded.events[:-1])
    difference = first_difference(recorded, shorter)
    assert difference is not None and difference.field == f"events[{len(shorter.events)}]"
    assert (difference.recorded, difference.replayed) == ("End of agent", "none")
    other = dataclasses.replace(recorded, summary={**(recorded.summary or {}), "success": "perhaps"})
    difference = first_difference(recorded, other)
    assert difference is not None and difference.field == "outcome.success"


def test_other_town_is_reported(recorded: Session) -> None:
    without = dataclasses.replace(recorded, decisions=())  # its places are not those of the other town
    difference = first_difference(without, resimulate(without, load_town("midtown")))
    assert difference is not None and (difference.frame, difference.field) == (-1, "header.town")


def test_what_cannot_be_played_again_is_refused(recorded: Session) -> None:
    with pytest.raises(SessionError, match="was not recorded"):
        resimulate(dataclasses.replace(recorded, decisions=None), TOWN)
    with pytest.raises(SessionError, match="has no seed"):
        resimulate(dataclasses.replace(recorded, header=dataclasses.replace(recorded.header, seed=None)), TOWN)
    for fields, message in (
        ({"moved": 1}, "'moved' is none of"),
        ({"move": 99}, "field 'move' is 99"),
        ({"slots": [70]}, "beyond the 69 places"),
        ({"slots": "all"}, "a list of whole numbers"),
    ):
        hostile = (Decision(frame=0, actions={Role.PARTICIPANT: fields}),)
        with pytest.raises(SessionError, match=f"decision at frame 0.*{message}"):
            resimulate(dataclasses.replace(recorded, decisions=hostile), TOWN)


@pytest.mark.parametrize("reason", [reason for reason in EndReason if reason.breaks_off])
def test_sessions_that_people_break_off_replay_to_their_end(reason: EndReason, tmp_path: Path) -> None:
    engine = SessionEngine("brookside")
    engine.reset(seed=4)
    with SessionWriter(tmp_path / "one", engine.session_header()) as writer:
        recorder = SessionRecorder(engine, writer)
        for _ in range(5):
            actions = idle_actions(engine.limits)
            engine.step(actions)
            recorder.record(actions)
        engine.break_off(reason)
        recorder.record_end()
        writer.finish(engine.summary())
    session = Session.load(tmp_path / "one")
    assert session.complete and session.events[-1].data["reason"] == reason.value
    assert first_difference(session, resimulate(session, engine.town)) is None


def test_only_people_and_the_program_break_a_session_off() -> None:
    engine = SessionEngine("brookside")
    engine.reset(seed=4)
    with pytest.raises(ValueError, match="must be one of left, ended, technical"):
        engine.break_off(EndReason.ARRIVED)
    engine.break_off(EndReason.LEFT)
    with pytest.raises(RuntimeError, match="over"):
        engine.break_off(EndReason.LEFT)


def test_finished_session_that_lost_its_end_differs(recorded: Session) -> None:
    damaged = dataclasses.replace(recorded, events=recorded.events[:-1], complete=False)
    difference = first_difference(damaged, resimulate(damaged, TOWN))
    assert difference is not None
    assert (difference.field, difference.recorded) == (f"events[{len(damaged.events)}]", "none")


def test_sessions_without_frames_can_be_compared(recorded: Session) -> None:
    nothing = Session(header=recorded.header, events=(), trajectory=recorded.trajectory[:0])
    other = dataclasses.replace(nothing, header=dataclasses.replace(recorded.header, story="Another one."))
    assert first_difference(nothing, nothing, strict=True) is None
    difference = first_difference(nothing, other, strict=True)
    assert difference is not None and difference.field == "header.story"
