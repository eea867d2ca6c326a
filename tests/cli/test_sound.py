"""Sound of spoken sessions on the command line: `show --play`, and the sound track of `film`."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

from dorothie_gym.archive import read_session
from dorothie_gym.archive.sdn.writer import write_sdn
from dorothie_gym.archive.sound import sound_track, utterance_audio
from dorothie_gym.cli import app
from dorothie_gym.session.recording import Session
from dorothie_gym.support.audio import read_audio
from tests.session.recording.spoken import spoken_session


def sound_of(video: Path) -> np.ndarray:
    """Returns the sound track of a video at 16 kHz."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="needs the extra 'video'").get_ffmpeg_exe()
    raw = subprocess.run(
        [ffmpeg, "-v", "error", "-i", str(video), "-f", "s16le", "-ac", "1", "-ar", "16000", "-"],
        capture_output=True,
        check=True,
        env=dict(os.environ),
    ).stdout
    return np.frombuffer(raw, "<i2") / 32768


def likeness(heard: np.ndarray, track: np.ndarray) -> float:
    """Returns the correlation of the loudness of two tracks in blocks of 0.1 s."""
    blocks = [np.abs(each[: len(each) // 1600 * 1600]).reshape(-1, 1600).mean(axis=1) for each in (heard, track)]
    count = min(map(len, blocks))
    return float(np.corrcoef(blocks[0][:count], blocks[1][:count])[0, 1])


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return spoken_session(tmp_path_factory.mktemp("sound") / "spoken")


def test_transcript_numbers_the_utterances_that_can_be_played(session: Path) -> None:
    page = call("show", session).output
    numbers = [int(number) for number in re.findall(r"\(audio (\d+)\)", page)]
    assert numbers == [utterance.number for utterance in Session.load(session).utterances()]


def test_utterance_is_written_as_wav(session: Path, tmp_path: Path) -> None:
    loaded = Session.load(session)
    utterance = max(loaded.utterances(), key=lambda each: len(each.moves))
    assert len(utterance.moves) > 1
    done = call("show", session, "--play", utterance.number, "--out", tmp_path / "u.wav")
    assert done.exit_code == 0, done.output
    whole = read_audio(tmp_path / "u.wav")
    assert len(whole) / 16000 == pytest.approx(utterance.end - utterance.start, abs=0.002)
    done = call("show", session, "--play", f"{utterance.number}.1", "--out", tmp_path / "s.wav")
    assert done.exit_code == 0, done.output
    name = str(loaded.events[utterance.moves[1].index].data["audio"])
    assert np.array_equal(read_audio(tmp_path / "s.wav"), read_audio(loaded.audio[name]))


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ("first", "give the number of an utterance"),
        ("4000", "has no utterance 4000 (numbers: 0 to"),
        ("0.9", "utterance 0 has no span 9"),
    ],
)
def test_wrong_number_is_reported(session: Path, tmp_path: Path, wanted: str, message: str) -> None:
    failed = call("show", session, "--play", wanted, "--out", tmp_path / "u.wav")
    assert failed.exit_code == 2 and message in failed.output.replace("\n", " ")
    assert not (tmp_path / "u.wav").exists()


def test_damaged_audio_is_one_line(session: Path, tmp_path: Path) -> None:
    loaded = Session.load(session)
    copy = loaded.save(tmp_path / "copy")
    name = str(next(event.data["audio"] for event in loaded.events if "audio" in event.data))
    file = copy / "utterance" / name
    file.write_bytes(file.read_bytes()[:200])
    failed = call("show", copy, "--play", 0, "--out", tmp_path / "u.wav")
    assert failed.exit_code == 2 and name in failed.output and failed.output.count("\n") == 1
    for path in file.parent.iterdir():
        path.unlink()
    failed = call("show", copy, "--play", 0, "--out", tmp_path / "u.wav")
    assert failed.exit_code == 2 and "utterance 0 has no audio" in failed.output.replace("\n", " ")


def _player(folder: Path, name: str, body: str) -> None:
    folder.mkdir(exist_ok=True)
    program = folder / name
    program.write_text(f"#!{sys.executable}\nimport sys\n{body}\n", encoding="utf-8")
    program.chmod(0o755)


def test_player_gets_the_sound_and_a_failing_one_is_passed_over(
    session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    failed = call("show", session, "--play", 0)
    assert failed.exit_code == 1 and "no program that plays sound is installed" in failed.output.replace("\n", " ")
    _player(tmp_path / "bin", "paplay", "sys.exit('Connection refused')")
    failed = call("show", session, "--play", 0)
    assert failed.exit_code == 1 and "paplay: Connection refused" in failed.output.replace("\n", " ")
    _player(
        tmp_path / "bin", "aplay", f"open({str(tmp_path / 'got.wav')!r}, 'wb').write(open(sys.argv[-1], 'rb').read())"
    )
    done = call("show", session, "--play", 0)
    assert done.exit_code == 0 and "played by aplay" in done.output
    assert np.array_equal(read_audio(tmp_path / "got.wav"), utterance_audio(Session.load(session), 0))


def test_sound_track_has_each_utterance_at_its_time(session: Path, tmp_path: Path) -> None:
    loaded = Session.load(session)
    track = sound_track(loaded, 0.0, 12.0)
    talking = np.zeros(len(track), dtype=bool)
    for utterance in loaded.utterances():
        talking[round(utterance.start * 16000) - 40 : round(utterance.end * 16000) + 40] = True
    assert not track[~talking].any() and np.abs(track[talking]).mean() > 1e-3
    first = next(iter(loaded.utterances()))
    later = sound_track(loaded, first.start, 12.0)
    assert later[: len(utterance_audio(loaded, first.number))] == pytest.approx(
        track[round(first.start * 16000) :][: len(utterance_audio(loaded, first.number))], abs=1e-6
    )
    again = read_session(write_sdn(loaded, tmp_path / "log_1"))
    assert np.abs(sound_track(again, 0.0, 12.0) - track).max() < 2e-4
    assert read_session(again.save(tmp_path / "native")).audio.keys() == again.audio.keys()


@pytest.mark.long
def test_film_of_a_spoken_session_has_its_sound(session: Path, tmp_path: Path) -> None:
    for name in ("v.mp4", "v.mkv"):
        done = call("film", session, "--out", tmp_path / name, "--view", "map", "--fps", 2, "--json")
        assert done.exit_code == 0, done.output
        facts = json.loads(done.stdout)
        assert facts["sound"] is True
        heard = sound_of(tmp_path / name)
        track = sound_track(Session.load(session), 0.0, facts["pictures"] / 2)
        assert len(heard) == pytest.approx(len(track), abs=4000)
        assert likeness(heard, track) > 0.9  # AAC delays by 64 ms


@pytest.mark.long
def test_video_of_a_run_has_its_sound(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg", reason="needs the extra 'video'")
    options = ("--town", "brookside", "--seed", 5, "--max-seconds", 12, "--view", "map", "--json")
    done = call("run", "--speech", "--video", tmp_path / "v.mp4", "--out", tmp_path / "s", *options)
    assert done.exit_code == 0, done.output
    assert [path.name for path in tmp_path.glob("*.mp4")] == ["v.mp4"]
    heard = sound_of(tmp_path / "v.mp4")
    track = sound_track(Session.load(tmp_path / "s"), 0.0, 12.0)
    assert len(heard) == pytest.approx(len(track), abs=4000) and np.abs(track).max() > 0.01
    assert likeness(heard, track) > 0.9
