"""Sessions in which talk is synthesised, mixed with noise and recognised."""

import copy
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rapidfuzz.distance import Levenshtein

from dorothie_gym import DuoWizardEnv, EnvConfig
from dorothie_gym.archive import first_difference, read_session
from dorothie_gym.archive.sdn.writer import write_sdn
from dorothie_gym.envs.duo_wizard_vector_env import DuoWizardVectorEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.evaluation.rollout.replay import resimulate
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED
from dorothie_gym.session.config import ChannelKind
from dorothie_gym.session.recorder import SessionRecorder, expand, idle_actions
from dorothie_gym.session.recording import Session, SessionWriter
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.speech import spoken_words
from dorothie_gym.speech.spoken_dialogue import SpokenDialogue, SpokenSpan
from dorothie_gym.support.audio import read_audio

TOWN = "brookside"
SPEAKERS = (Role.PARTICIPANT, Role.CO_WIZARD)
ALONE = WorldConfig(vehicles=0, pedestrians=0)
CONFIG = EnvConfig(channel=ChannelKind.SPEECH, max_seconds=45.0, world=ALONE)


def played(folder: Path, seed: int = 10, seconds: float = 45.0) -> Session:
    engine = SessionEngine(TOWN, config=replace(CONFIG, max_seconds=seconds))
    policies = {role: player.make(role, engine.limits) for role, player in ALL_SCRIPTED.items()}
    play_session(engine, policies, seed=seed, folder=folder)
    return Session.load(folder)


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    return played(tmp_path_factory.mktemp("spoken") / "session")


@pytest.mark.long
def test_session_is_spoken_without_a_socket(tmp_path: Path) -> None:
    events: list[str] = []
    watching = True

    def watch(event: str, _: tuple[object, ...]) -> None:  # an audit hook stays until the process ends
        if watching and event.startswith(("socket.", "open")):
            events.append(event)

    sys.addaudithook(watch)
    again = played(tmp_path / "again", seconds=12.0)
    watching = False
    assert again.audio and "open" in events, "the hook sees what is opened"
    assert not [event for event in events if event.startswith("socket.")]


def test_every_span_has_its_audio_as_long_as_the_utterance(session: Session) -> None:
    assert len(session.all_moves) >= 5
    for utterance in session.utterances():
        names = [str(session.events[move.index].data["audio"]) for move in utterance.moves]
        seconds = [len(read_audio(session.audio[name])) / 16000 for name in names]
        assert sum(seconds) == pytest.approx(utterance.end - utterance.start, abs=0.002)
        assert min(seconds) >= 0.6 - 1e-3
    assert {str(event.data.get("audio")) for event in session.events if "audio" in event.data} == set(session.audio)


def test_most_words_are_recognised_and_others_change_what_is_heard(session: Session) -> None:
    edits = words = 0
    for utterance in session.utterances():
        said, heard = spoken_words(utterance.text), spoken_words(utterance.moves[0].recognised or "")
        edits, words = edits + Levenshtein.distance(said, heard), words + len(said)
    assert 0 < edits < 0.3 * words


def test_same_seed_gives_the_same_session_and_the_same_audio_bytes(session: Session, tmp_path: Path) -> None:
    again = played(tmp_path / "again")
    assert first_difference(session, again, strict=True) is None
    assert session.audio.keys() == again.audio.keys()
    assert all(path.read_bytes() == again.audio[name].read_bytes() for name, path in session.audio.items())


def test_session_is_simulated_again_from_its_actions(session: Session) -> None:
    assert session.header.config["channel"] == "speech"
    assert first_difference(session, resimulate(session, load_town(TOWN))) is None


def test_saved_session_keeps_its_audio(session: Session, tmp_path: Path) -> None:
    again = Session.load(session.save(tmp_path / "copy"))
    assert again.audio.keys() == session.audio.keys()
    assert again.digest == session.digest


def test_sdn_layout_has_one_file_for_each_utterance(session: Session, tmp_path: Path) -> None:
    folder = write_sdn(session, tmp_path / "log_1")
    files = {path.name: path for path in (folder / "utterance").iterdir()}
    assert set(files) == {f"utterance_{utterance.number}.flac" for utterance in session.utterances()}
    for utterance in session.utterances():
        seconds = len(read_audio(files[f"utterance_{utterance.number}.flac"])) / 16000
        assert seconds == pytest.approx(utterance.end - utterance.start, abs=0.002)
    again = read_session(folder)
    assert [move.recognised for move in again.all_moves] == [move.recognised for move in session.all_moves]


@pytest.mark.long
def test_copies_of_a_session_hear_the_same(tmp_path: Path) -> None:
    engine = SessionEngine(TOWN, config=CONFIG)
    policies = {role: player.make(role, engine.limits) for role, player in ALL_SCRIPTED.items()}
    kept: list[tuple[SessionEngine, int]] = []

    def keep(running: SessionEngine) -> None:
        if running.session.dialogue.in_progress and running.session.world.time > 5.0 and not kept:
            kept.append((copy.deepcopy(running), running.session.decisions))

    play_session(engine, policies, seed=3, folder=tmp_path / "s", on_step=keep)
    (other, decisions), session = kept[0], Session.load(tmp_path / "s")
    frames = {decision.frame: decision for decision in session.decisions or ()}
    with SessionWriter(tmp_path / "other", other.session_header()) as writer:
        SessionRecorder(other, writer)
    heard = []
    for _ in range(12):
        decision = frames.get(other.session.world.frame)
        other.step(idle_actions(other.limits) if decision is None else expand(decision, other.limits))
        heard += [event.data for event in other.last_events if event.type == "DialogueMove"]
    last = other.session.world.frame
    first = round(decisions * 30 / CONFIG.decision_frequency)
    wanted = [e.data for e in session.events if e.type == "DialogueMove" and first < e.frame <= last]
    assert heard == wanted
    assert heard


def test_text_channel_needs_no_speech_and_leaves_no_trace() -> None:
    env = DuoWizardEnv(TOWN, config=EnvConfig(world=ALONE))
    env.reset(seed=1)
    assert "channel" not in env.engine.session_header().config
    assert env.engine.last_recordings == {}


def test_settings_are_checked() -> None:
    assert EnvConfig(channel="speech").channel is ChannelKind.SPEECH  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"EnvConfig\.channel is 'radio'; it must be text or speech"):
        EnvConfig(channel="radio")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r'config\.channel is "speech"; batches do not speak'):
        DuoWizardVectorEnv(2, TOWN, config=CONFIG)


def test_speakers_have_the_voices_of_their_personas_and_differ(session: Session) -> None:
    personas = session.header.extra["personas"]
    assert isinstance(personas, dict) and all(0.86 <= personas[str(role)]["pitch"] <= 0.97 for role in SPEAKERS)
    spoken = SpokenDialogue(np.random.SeedSequence(1), words_per_second=2.7, classify=True)
    spoken.give_voices({Role.PARTICIPANT: 0.951, Role.CO_WIZARD: 0.96})
    pitches = {role: spoken._voices[role].pitch for role in SPEAKERS}
    assert pitches == {Role.PARTICIPANT: 0.95, Role.CO_WIZARD: 0.92}
    spoken.give_voices({Role.PARTICIPANT: 0.87})
    assert spoken._voices[Role.PARTICIPANT].pitch == 0.87


def test_recorded_voice_out_of_range_is_refused(session: Session) -> None:
    extra = {**session.header.extra, "personas": {"participant": {"pitch": 3.0}}}
    header = replace(session.header, extra=extra)
    with pytest.raises(SessionError, match=r"personas\.participant\.pitch is 3\.0; it must be in 0\.8\.\.1\.25"):
        resimulate(replace(session, header=header), load_town(TOWN))


def test_crosstalk_is_quieter_than_the_speaker() -> None:
    spoken = SpokenDialogue(np.random.SeedSequence(1), words_per_second=2.7, classify=True)
    samples = spoken.speak(Role.CO_WIZARD, "Which way now?", 1.0)
    spoken.begin(Role.CO_WIZARD, samples, end=10.0 + len(samples) / 16000)
    silence = SpokenSpan(10.5, np.zeros(len(samples), np.float32))
    heard = spoken._crosstalk(Role.PARTICIPANT, silence)
    assert heard[: len(samples) - 8000] == pytest.approx(samples[8000:] * 10 ** (-15 / 20))
    assert not heard[len(samples) - 8000 :].any()
