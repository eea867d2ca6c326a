from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import Role
from dorothie_gym.session.recording import Decision, Session, SessionWriter
from tests.session.recording.builders import header, rows, session

SAID = {Role.PARTICIPANT: {"move": 1, "slots": [3, 40], "utterance": "Left, please: çà et là."}}
DONE = {Role.CO_WIZARD: {"physical": 4, "angle": -90}, Role.AD_WIZARD: {"exception": 2}}


def record(folder: Path, *, finish: bool = True) -> Path:
    with SessionWriter(folder, header()) as writer:
        for frame, actions in ((0, SAID), (15, {}), (30, DONE)):
            writer.add_decision(frame, actions)
            writer.add_frames(rows(frame + 1, 15))
        if finish:
            writer.finish({"success": True})
    return folder


def test_decisions_are_read_as_they_were_written_without_the_idle_ones(tmp_path: Path) -> None:
    found = Session.load(record(tmp_path))
    assert found.complete
    assert found.decisions == (Decision(frame=0, actions=SAID), Decision(frame=30, actions=DONE))


def test_session_without_actions_differs_from_one_with_unknown_decisions(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "idle", header()) as writer:
        writer.add_decision(0, {})
        writer.finish({})
    with SessionWriter(tmp_path / "unknown", header()) as writer:
        writer.finish({})
    assert Session.load(tmp_path / "idle").decisions == ()
    assert Session.load(tmp_path / "unknown").decisions is None


def test_decisions_count_in_the_hash_and_are_saved(tmp_path: Path) -> None:
    found = Session.load(record(tmp_path / "one"))
    copy = Session.load(found.save(tmp_path / "two"))
    assert copy.decisions == found.decisions and copy.digest == found.digest
    assert dataclasses.replace(found, decisions=found.decisions[:1]).digest != found.digest  # type: ignore[index]  # the recorded session has decisions
    assert session(name="none").digest != dataclasses.replace(session(name="none"), decisions=()).digest


def test_torn_line_is_left_out_and_the_session_is_incomplete(tmp_path: Path) -> None:
    file = record(tmp_path, finish=False) / "actions.jsonl"
    file.write_bytes(file.read_bytes()[:-5])
    found = Session.load(tmp_path)
    assert not found.complete and [decision.frame for decision in found.decisions or ()] == [0]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('{"frame":45,"passenger":{}}', "line 3: field 'passenger' is none of participant, co_wizard, ad_wizard"),
        ('{"frame":45,"participant":[1]}', "line 3: field 'participant' is .* an object"),
        ('{"frame":-1}', "line 3: field 'frame' is -1"),
        ('{"frame":30}', "line 3: frame 30 after 30"),
        ('{"frame":45', "line 3, column 12: not JSON"),
    ],
)
def test_damaged_line_is_refused_and_named(tmp_path: Path, line: str, message: str) -> None:
    with (record(tmp_path) / "actions.jsonl").open("a") as file:
        file.write(line + "\n")
    with pytest.raises(SessionError, match=rf"actions\.jsonl, {message}"):
        Session.load(tmp_path)


def test_decisions_must_rise(tmp_path: Path) -> None:
    with SessionWriter(tmp_path, header()) as writer:
        writer.add_decision(15, {})
        with pytest.raises(SessionError, match="frame 15 after 15"):
            writer.add_decision(15, SAID)
