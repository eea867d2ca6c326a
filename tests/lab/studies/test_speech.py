"""Studies in which people speak: consent, recordings with the session, export, withdrawal."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("pocketsphinx", reason="needs the extra speech")

from dorothie_gym.archive.sound import utterance_audio
from dorothie_gym.errors import InputFileError
from dorothie_gym.evaluation.rollout.replay import resimulate
from dorothie_gym.lab.studies.study_file import read_study
from dorothie_gym.maps import load_town
from dorothie_gym.session.recording import Session
from dorothie_gym.speech import find_synthesizer, say
from tests.lab.studies.content import SOLO, write_study
from tests.lab.studies.serving import Client, ServedStudy
from tests.lab.studies.test_server import exported

SPOKEN = {
    **SOLO,
    "session": {"max_seconds": 12.0, "pictures": False, "speech": True},
    "consent": {**SOLO["consent"], "voice": "I agree that my voice is recorded."},
}


def heard(person: Client, text: str) -> dict[str, object]:
    """Lets a person speak; returns the answer of the server."""
    samples = np.rint(say(find_synthesizer(), text) * 32767).astype("<i2").tobytes()
    token = {"Authorization": f"Bearer {person.view['token']}"}
    status, _, content = person.send("POST", "/speech/heard", samples, token)
    assert status == 200
    return dict(json.loads(content))


def enter(person: Client) -> None:
    person.do("join")
    assert person.view["statements"][-1] == "I agree that my voice is recorded."
    assert person.post("consent", {"agreed": [True, True]}) == 409, "the voice is not agreed to"
    person.do("consent", {"agreed": [True, True, True]})
    person.do("answers", {"stage": "before", "answers": {"age": 30}})
    person.do("proceed", {"stage": "instructions"})


@pytest.mark.long
def test_what_people_say_is_recorded_exported_and_deleted(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with ServedStudy(write_study(tmp_path, SPOKEN), data) as served:
        one = Client(served.port)
        enter(one)
        with one.sit():
            found = heard(one, "Turn left, please.")
            assert "left" in str(found["text"]) and found["audio"] is None, "the practice drive is not recorded"
        one.do("proceed", {"stage": "tutorial"})
        with one.sit() as socket:
            while json.loads(socket.recv(timeout=10)).get("state") != "running":
                pass
            found = heard(one, "Turn left at the KFC, please.")
            assert found["audio"] == "participant_1.flac"
            socket.send(json.dumps({"k": "say", "n": 1, "text": found["text"], "audio": found["audio"]}))
            one.follow(lambda: one.view.get("over"))
        (folder,) = (data / "sessions").iterdir()
        session = Session.load(folder)
        spoken = next(each for each in session.utterances() if "KFC" in each.text)
        assert len(utterance_audio(session, spoken.number)) > 8000
        assert resimulate(session, load_town("brookside")).digest == session.digest
        row = next(row for row in exported(data, tmp_path / "out", "utterances") if "KFC" in row["text"])
        assert (
            row["audio"] == f"sessions/{folder.name}/utterance/participant_1.flac" and (data / row["audio"]).is_file()
        )
        one.do("withdraw", {"sure": True})
        assert not list(data.rglob("*.flac")) and not list((data / "sessions").iterdir())
    assert all(not row["audio"] for row in exported(data, tmp_path / "out", "utterances"))


def test_a_study_with_speech_needs_a_statement_on_voices(tmp_path: Path) -> None:
    content = copy.deepcopy(SPOKEN)
    del content["consent"]["voice"]
    with pytest.raises(InputFileError, match="consent: field 'voice' is missing"):
        read_study(write_study(tmp_path, content))
    content["session"]["speech"] = False
    assert read_study(write_study(tmp_path, content)).statements == content["consent"]["statements"]
