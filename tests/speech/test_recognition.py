"""Synthesis and recognition with the real voice and recogniser."""

import hashlib
import math
import os
import random
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.dialogue import is_partly_inaudible
from dorothie_gym.dialogue.conversation import INAUDIBLE
from dorothie_gym.errors import AudioError, SpeechError
from dorothie_gym.ontology import ActionValue, DialogueMove, LandmarkName, StreetName
from dorothie_gym.speech import (
    Hypothesis,
    Recognition,
    RecognizedWord,
    Voice,
    audible,
    find_recognizer,
    find_synthesizer,
    mixed,
    pink_noise,
    readable,
    say,
    understand_speech,
)
from dorothie_gym.speech.language import load_language
from dorothie_gym.speech.synthesizer import SLOWEST
from dorothie_gym.support.audio import resample
from dorothie_gym.support.installation import pip_install
from tests.support.cache_damage import DAMAGES

TEXT = "Take the second left onto Bonisteel, we need to go to the KFC."


@pytest.fixture(scope="module")
def audio() -> np.ndarray:
    return say(find_synthesizer(), TEXT, seed=3)


def test_speech_is_mono_at_a_stated_rate(audio: np.ndarray) -> None:
    speaker = find_synthesizer()
    samples = speaker.synthesize(TEXT, seed=3)
    assert samples.dtype == audio.dtype == np.float32
    assert samples.ndim == 1
    assert np.abs(samples).max() <= 1.0
    assert len(samples) / speaker.sample_rate == pytest.approx(len(audio) / 16000, abs=0.01)
    assert 2.0 < len(audio) / 16000 < 6.0


def test_rate_and_pitch_of_a_voice_change_time_and_frequency(audio: np.ndarray) -> None:
    slow = say(find_synthesizer(), TEXT, Voice(rate=0.8), seed=3)
    assert len(slow) / len(audio) == pytest.approx(1 / 0.8, rel=0.08)
    high = say(find_synthesizer(), TEXT, Voice(pitch=1.15), seed=3)
    assert len(high) / len(audio) == pytest.approx(1.0, rel=0.08)


def test_equal_seeds_give_equal_bytes_in_two_processes_without_a_socket(audio: np.ndarray) -> None:
    script = f"""
import hashlib, sys
def watch(event, arguments):
    if event.startswith("socket."):
        raise RuntimeError(f"{{event}} {{arguments}}")
sys.addaudithook(watch)
from dorothie_gym.speech import find_recognizer, find_synthesizer, say
samples = say(find_synthesizer(), {TEXT!r}, seed=3)
print(hashlib.sha256(samples.tobytes()).hexdigest(), find_recognizer().recognize(samples, 16000).text)
"""
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=os.environ, check=False)
    assert ran.returncode == 0, ran.stderr
    digest, _, text = ran.stdout.strip().partition(" ")
    assert digest == hashlib.sha256(audio.tobytes()).hexdigest()
    assert text == find_recognizer().recognize(audio, 16000).text
    assert not np.array_equal(say(find_synthesizer(), TEXT, seed=4), audio)


def test_words_are_recognised_with_times_and_confidences(audio: np.ndarray) -> None:
    found = find_recognizer().recognize(audio, 16000)
    assert found.text == "take the second left onto bonisteel we need to go to the k f c"
    assert " ".join(word.text for word in found.words) == found.text
    assert all(0.0 <= word.start < word.end <= len(audio) / 16000 + 0.3 for word in found.words)
    assert all(0.0 <= word.confidence <= 1.0 for word in found.words)
    assert found.hypotheses[0].text == found.text
    assert sum(each.weight for each in found.hypotheses) == pytest.approx(1.0)


def test_act_is_understood_without_marks_and_capitals(audio: np.ndarray) -> None:
    found = understand_speech(find_recognizer().recognize(audio, 16000))
    assert found.act.move is DialogueMove.INSTRUCT
    assert found.act.slots >= {ActionValue.J_TURN, LandmarkName.KFC, StreetName.BONISTEEL}
    assert 0.0 < found.confidence <= 1.0


@pytest.mark.parametrize(
    ("spoken", "written"),
    [
        ("should i turn left here", "should I turn left here?"),
        ("yeah go to the seven eleven", "yeah, go to the 7-Eleven."),
        ("which way now", "which way now?"),
        ("we have to take right", "we have to take right."),
        ("you know the way right", "you know the way, right?"),
        ("okay turning left", "okay, turning left."),
        ("", INAUDIBLE),
    ],
)
def test_recognised_words_are_written_with_marks(spoken: str, written: str) -> None:
    assert readable(spoken) == written


def heard(*words: tuple[str, float], others: Sequence[str] = ()) -> Recognition:
    found = tuple(RecognizedWord(text=text, start=0.0, end=0.1, confidence=sure) for text, sure in words)
    text = " ".join(word.text for word in found)
    hypotheses = tuple(Hypothesis(text=each, weight=1.0 / (1 + len(others))) for each in (text, *others))
    return Recognition(text=text, words=found, hypotheses=hypotheses)


@pytest.mark.parametrize(
    ("recognition", "audible_words"),
    [
        (heard(("the", 0.01), ("house", 0.05)), "the ..."),
        (heard(("yes", 0.9)), "yes"),
        (heard(("um", 0.01), ("stop", 0.9)), "um stop"),
        (
            heard(("it's", 0.9), ("all", 0.1), ("done", 0.1), ("here", 0.9), others=("it's all gone here",)),
            "it's ... here",
        ),
        (heard(("it", 0.9), ("is", 0.1), ("raining", 0.9), others=("it was raining",)), "it is raining"),
        (
            heard(("turn", 0.1), ("left", 0.9), ("now", 0.9), others=("then left now", "stop left now")),
            "... left now",
        ),
        (heard(("great", 0.9), others=("overrated", "brake")), "..."),
        (heard(("great", 0.9), others=("overrated", "rate")), "great"),
        (heard(("drive", 0.9), others=("brake",)), "drive"),
        (heard(("stop", 0.9), others=("that's done",)), "stop"),
        (heard(("i", 0.1), ("said", 0.1), ("more", 0.9)), "... more"),
        (heard(("where", 0.1), ("to", 0.9), ("now", 0.9), others=("we're to now",)), "where to now"),
        (heard(("go", math.nan), ("left", math.nan)), "go left"),
        (Recognition(text=""), ""),
    ],
)
def test_doubtful_words_are_inaudible_where_they_may_change_the_meaning(
    recognition: Recognition, audible_words: str
) -> None:
    assert audible(recognition) == audible_words


def test_inaudible_words_stay_so_in_writing() -> None:
    assert readable("turn ... at the k f c").startswith("turn ...") and readable("...") == INAUDIBLE
    assert is_partly_inaudible(readable("do you see the ...")) and not is_partly_inaudible("wait, what?")


@pytest.mark.parametrize("rate", [8000, 11025, 22050, 44100, 48000, 96000])
def test_other_sample_rates_are_recognised(audio: np.ndarray, rate: int) -> None:
    assert "left" in find_recognizer().recognize(resample(audio, 16000, rate), rate).text.split()


def test_recognition_does_not_depend_on_what_was_heard_before(audio: np.ndarray) -> None:
    listener = find_recognizer()
    first = listener.recognize(audio, 16000)
    noise = pink_noise(16000, np.random.default_rng(1)) * np.float32(0.3)
    listener.recognize(noise, 16000)
    assert listener.recognize(audio, 16000) == first


def test_silence_has_no_words() -> None:
    found = find_recognizer().recognize(np.zeros(16000, np.float32), 16000)
    assert (found.text, found.words, found.hypotheses) == ("", (), ())
    assert understand_speech(found).text == INAUDIBLE


def test_hinted_names_are_preferred(audio: np.ndarray) -> None:
    noisy = mixed(audio, pink_noise(len(audio), np.random.default_rng(2)), 0.0)
    listener = find_recognizer()
    plain, hinted = (listener.recognize(noisy, 16000, hints=hints) for hints in ((), ("Bonisteel",)))
    share = [sum(each.weight for each in found.hypotheses if "bonisteel" in each.text) for found in (plain, hinted)]
    assert share[1] >= share[0]


def test_language_comes_from_the_cache_or_is_built_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pocketsphinx

    from dorothie_gym.speech import language, sphinx_recognizer

    monkeypatch.setenv("DOROTHIE_GYM_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(language, "transcripts", lambda: (("turn left", "then stop"), ("okay",)))
    monkeypatch.setattr(language, "grammar_sentences", lambda: ("go to the KFC",))
    dictionary = Path(pocketsphinx.get_model_path()) / "en-us" / "cmudict-en-us.dict"
    built = load_language(dictionary, sphinx_recognizer._phonemes)
    assert "\tthen stop\t" in built.arpa
    with monkeypatch.context() as context:
        context.setattr(language, "build_language", None)  # not built again
        assert load_language(dictionary, sphinx_recognizer._phonemes) == built
    if os.name == "posix":  # pipes
        (kept,) = (tmp_path / "cache" / "speech").iterdir()
        for kind in sorted(DAMAGES):
            DAMAGES[kind](kept, random.Random(0))
            assert load_language(dictionary, sphinx_recognizer._phonemes) == built, kind


def test_unknown_names_and_wrong_requests_are_refused(audio: np.ndarray) -> None:
    with pytest.raises(SpeechError, match=r"no synthesiser 'hibary': did you mean 'hibari'\? choose one of"):
        find_synthesizer("hibary")
    with pytest.raises(SpeechError, match="no recogniser 'sphinx'"):
        find_recognizer("sphinx")
    with pytest.raises(SpeechError, match="hibari has no voice 'emma'"):
        find_synthesizer().synthesize("Hello.", voice="emma")
    with pytest.raises(ValueError, match=r"rate is 9; it must be in 0\.5\.\.2"):
        find_synthesizer().synthesize("Hello.", rate=9)
    with pytest.raises(ValueError, match="text has 1001 characters"):
        find_synthesizer().synthesize("a" * 1001)
    with pytest.raises(ValueError, match=r"Voice.pitch is 2"):
        Voice(pitch=2)
    for seconds in (70, 36000):
        long = np.broadcast_to(np.float32(0.0), seconds * 16000)  # ten hours take no memory
        with pytest.raises(AudioError, match=f"is {seconds} s long; at most 60 s"):
            find_recognizer().recognize(long, 16000)
    for rate in (7999, 96001):
        with pytest.raises(AudioError, match=f"has {rate} samples per second; 8000 to 96000 are supported"):
            find_recognizer().recognize(np.zeros(1600, np.float32), rate)
    assert not len(find_synthesizer().synthesize("...", rate=SLOWEST))


@pytest.mark.parametrize(
    ("text", "letter"),
    [("\u8bf7\u5de6\u8f6c", "\u8bf7"), ("Turn left, \u043d\u0430\u043b\u0435\u0432\u043e!", "\u043d")],
)
def test_text_in_another_script_is_refused(text: str, letter: str) -> None:
    with pytest.raises(SpeechError, match=f"hibari speaks English and has no voice for {letter!r} in"):
        find_synthesizer().synthesize(text)
    assert len(find_synthesizer().synthesize("Zum Caf\u00e9 an der Stra\u00dfe, \u00bd mile \u2192")), "read as English"


def test_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    from dorothie_gym.speech.sphinx_recognizer import SphinxRecognizer

    monkeypatch.setitem(sys.modules, "pocketsphinx", None)
    with pytest.raises(SpeechError, match=rf"pocketsphinx is needed .*{re.escape(pip_install('speech'))}"):
        SphinxRecognizer()


def test_other_voice_model_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from dorothie_gym.speech import hibari_synthesizer

    monkeypatch.setattr(hibari_synthesizer, "MODEL_SHA256", "0" * 64)
    with pytest.raises(SpeechError, match=r"is not the model of hibari-tts 0\.2\.1"):
        hibari_synthesizer.HibariSynthesizer()


def test_missing_and_damaged_acoustic_models_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pocketsphinx

    from dorothie_gym.speech.sphinx_recognizer import SphinxRecognizer

    models = Path(pocketsphinx.get_model_path()) / "en-us"
    monkeypatch.setattr(pocketsphinx, "get_model_path", lambda *_: str(tmp_path))
    with pytest.raises(SpeechError, match=r"cmudict-en-us\.dict: is missing or damaged; pip install --force-reinstall"):
        SphinxRecognizer()
    (tmp_path / "en-us" / "en-us").mkdir(parents=True)
    shutil.copy(models / "cmudict-en-us.dict", tmp_path / "en-us")
    shutil.copy(models / "en-us" / "mdef", tmp_path / "en-us" / "en-us")
    with pytest.raises(SpeechError, match=r"en-us/en-us: is missing or damaged; pip install --force-reinstall pocket"):
        SphinxRecognizer()


def test_the_steps_of_a_plan_have_the_shares_of_the_hypotheses_that_hold_them() -> None:
    words = (
        ("turn left at the ikea then stop", 0.6),
        ("turn left at the ikea then", 0.3),
        ("burn left at the pine", 0.1),
    )
    hypotheses = tuple(Hypothesis(text=text, weight=weight) for text, weight in words)
    found = understand_speech(Recognition(text=words[0][0], hypotheses=hypotheses))
    assert [step.action.value for step, _ in found.steps] == ["turn", "stop"]
    assert [round(share, 6) for _, share in found.steps] == [0.9, 0.6]
