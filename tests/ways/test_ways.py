"""The four ways of docs/architecture.md: their files are those that real calls go through, and they are few."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.archive.visibility import Task
from dorothie_gym.evaluation.closed_loop.leaderboard import leaderboard_page, read_entries
from dorothie_gym.evaluation.closed_loop.running import RolloutSettings, roll_out
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.evaluation.teacher_forced.features import build, gather, points
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.policy_loader import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from tests.ways.tracing import PACKAGE, Stage, files_of, files_on_page, traced

MOST = {
    "One action: from `env.step` to the throttle": 8,
    "One utterance: from the console to the reply": 16,
    "One session: from the recording to a batch": 10,
    "One rollout: from the settings to a row of the leaderboard": 9,
}
"""Largest number of files on each way."""

ACTION, UTTERANCE, SESSION, ROLLOUT = MOST


def check(heading: str, stages: list[Stage]) -> None:
    found = files_of(stages)
    assert sorted(files_on_page(heading)) == sorted(found), [stage.path for stage in stages]
    assert len(found) <= MOST[heading]


@pytest.mark.parametrize("heading", MOST)
def test_page_lists_files_that_exist_and_not_too_many(heading: str) -> None:
    files = files_on_page(heading)
    assert 0 < len(files) <= MOST[heading]
    assert [name for name in files if not (PACKAGE / name).is_file()] == []


# --- One action -------------------------------------------------------------------------------------------------------

STEP = "envs/duo_wizard_v0.py:DuoWizardEnv.step"

ACTION_STAGES = [
    (STEP, "sim/ego/manoeuvres.py:command"),  # which leaves the manoeuvre in the plan of the world's arrays
    (STEP, "sim/ego/motion_control.py:guide"),
]

DRIVE = f"""
import json, sys
from dorothie_gym import DuoWizardEnv, EnvConfig
from dorothie_gym.ontology import AGENT_ROLES, PhysicalAction
from dorothie_gym.session.spaces.actions import CoWizardAction, Physical, noop
from dorothie_gym.sim.config import WorldConfig
from tests.ways.tracing import Stage, traced

stages = [Stage(*ends) for ends in {ACTION_STAGES!r}]
env = DuoWizardEnv("brookside", config=EnvConfig(world=WorldConfig(vehicles=0, pedestrians=0)))
env.reset(seed=1)
stop = CoWizardAction(physical=Physical(action=PhysicalAction.STOP)).encode(env.limits)
with traced(stages):
    env.step({{**{{str(role): noop(role, env.limits) for role in AGENT_ROLES}}, "co_wizard": stop}})
print(json.dumps([stage.path for stage in stages]))
"""


@pytest.mark.long
def test_an_action_reaches_the_throttle_by_the_files_of_the_page() -> None:
    variables = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(PACKAGE.parent)}
    done = subprocess.run(
        [sys.executable, "-c", DRIVE], env=variables, capture_output=True, text=True, check=False, cwd=PACKAGE.parent
    )
    assert done.returncode == 0, done.stderr
    paths = json.loads(done.stdout)
    check(ACTION, [Stage(*ends, path=path) for ends, path in zip(ACTION_STAGES, paths, strict=True)])


# --- One utterance ----------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_an_utterance_meets_its_reply_by_the_files_of_the_page() -> None:
    pytest.importorskip("starlette", reason="needs the extra console")
    from tests.lab.console.people import Table
    from tests.ways.typed_words import send_message

    table = Table("participant=human", seed=7)
    tick, listen = "lab/console/room.py:Room.tick", "policies/co_wizard/dialogue_update.py:listen"
    stages = [
        Stage("lab/console/server.py:_receive", "lab/console/room.py:Room.receive"),  # a queue
        Stage(tick, "lab/console/speech_input.py:typed_acts"),  # another one, of the seat
        Stage(tick, "lab/console/inbox.py:SeatInbox.take"),
        Stage(tick, "dialogue/conversation.py:Conversation.say"),  # until the words have been spoken
        Stage(tick, "dialogue/conversation.py:Conversation.deliver"),
        Stage(tick, "session/observations.py:ObservationBuilder.build"),  # read at the next decision
        Stage(tick, listen),
        Stage(listen, "policies/speech.py:SpeakingState.say"),  # the reply: spoken and delivered as above
        Stage(tick, "lab/console/talk_log.py:TalkLog.hear"),
        Stage(tick, "lab/console/seat_frames.py:SeatFrames.of"),
    ]
    said = {"k": "say", "n": 1, "text": "turn left at the next intersection"}

    def answered() -> bool:
        speakers = [utterance.speaker for utterance in table.room.engine.session.dialogue.said]
        return speakers[-2:] == [Role.PARTICIPANT, Role.CO_WIZARD]

    with traced(stages):
        token = table.room.seats["participant"].token
        send_message(table.room, token, said, joined=lambda: table.run(1.0), sent=lambda: table.until(answered))
    check(UTTERANCE, stages)


# --- One session ------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_session_becomes_a_batch_by_the_files_of_the_page(tmp_path: Path) -> None:
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=60.0))
    scripted = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    play_session(engine, scripted, seed=3, folder=tmp_path / "session")
    features = "evaluation/teacher_forced/features"
    stages = [
        Stage(f"{features}/corpus_columns.py:build", "session/recording/session.py:Session.load"),
        Stage(f"{features}/corpus_columns.py:build", f"{features}/session_columns.py:extract"),
        Stage(f"{features}/point_table.py:points", "archive/visibility.py:visible_rows"),
        Stage(f"{features}/batch.py:gather", f"{features}/batch.py:gather"),
    ]
    with traced(stages):
        columns = build(tmp_path)
        table = points(columns, Task.NFD)
        batch = gather(columns, table, np.arange(len(table)))
    assert len(batch.session) == len(table) > 0
    check(SESSION, stages)


# --- One rollout ------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_rollout_becomes_a_row_by_the_files_of_the_page(tmp_path: Path) -> None:
    settings = RolloutSettings(towns=("brookside",), sessions=1, seed=5, config=EnvConfig(max_seconds=20.0))
    roll = "evaluation/closed_loop/running.py:roll_out"
    entries, page = (f"evaluation/closed_loop/leaderboard.py:{name}" for name in ("read_entries", "leaderboard_page"))
    stages = [
        Stage(roll, "session/session_engine.py:SessionEngine.step"),  # recorded: a folder
        Stage(roll, "evaluation/closed_loop/session_record.py:measure"),
        Stage(roll, "evaluation/closed_loop/results.py:RolloutResult.to_json"),  # written: a file
        Stage(entries, "evaluation/closed_loop/results.py:read_result"),
        Stage(page, "evaluation/closed_loop/metrics.py:interval_of"),
    ]
    with traced(stages):
        roll_out(settings, tmp_path / "rollout")
        text = leaderboard_page(read_entries([tmp_path / "rollout"]))
    assert "scripted" in text
    check(ROLLOUT, stages)
