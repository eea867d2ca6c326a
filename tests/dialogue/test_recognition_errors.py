"""The measured profile of recognition errors, and the text channel that imitates it."""

from __future__ import annotations

import json
from collections import Counter
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from rapidfuzz.distance import Levenshtein

from dorothie_gym.dialogue import AsrChannel, Loudness, WordClass, measured_errors, word_class
from dorothie_gym.dialogue.recognition_errors import LOUD_BELOW, MODERATE_BELOW
from dorothie_gym.ontology import Role
from dorothie_gym.session.config import EnvConfig
from tests.dialogue.test_asr_channel import SAID


def test_shipped_profile_is_a_measurement_of_thousands_of_words() -> None:
    text = resources.files("dorothie_gym.dialogue").joinpath("data/recognition_errors.json").read_text(encoding="utf-8")
    data, profile = json.loads(text), measured_errors()
    assert data["words"] > 5000 and "spoken sessions" in data["measured"]
    assert 0.005 < profile.rate < 0.2
    assert 0.0 < profile.substitutions + profile.deletions < 1.0
    assert set(profile.word_classes) == set(WordClass)
    assert set(profile.noises) == set(Loudness) and set(profile.speakers) == {Role.PARTICIPANT, Role.CO_WIZARD}
    assert EnvConfig().word_error_rate == round(profile.rate, 3)


@pytest.mark.parametrize(
    ("word", "kind"),
    [
        ("the", WordClass.COMMON),
        ("left,", WordClass.COMMON),
        ("Baits", WordClass.NAME),
        ("baits", WordClass.NAME),
        ("KFC?", WordClass.NAME),
        ("turquoise", WordClass.RARE),
        ("f", WordClass.COMMON),
    ],
)
def test_words_have_classes(word: str, kind: WordClass) -> None:
    assert word_class(word) is kind


def test_noise_has_classes_by_the_ratio_of_speech_to_noise() -> None:
    ratios = (LOUD_BELOW - 0.1, LOUD_BELOW, MODERATE_BELOW - 0.1, MODERATE_BELOW)
    assert [Loudness.of(ratio) for ratio in ratios] == ["loud", "moderate", "moderate", "quiet"]


def test_classes_of_words_are_misheard_as_often_as_measured() -> None:
    rng, errors, words = np.random.default_rng(3), Counter[WordClass](), Counter[WordClass]()
    channel = AsrChannel(rate=0.05, substitutions=1.0, deletions=0.0)
    for text in SAID * 40:
        heard = channel.transcribe(text, rng).split()
        for said, got in zip(text.split(), heard, strict=True):
            words[word_class(said)] += 1
            errors[word_class(said)] += said != got
    wanted = {kind: 0.05 * relative for kind, relative in measured_errors().word_classes.items()}
    for kind, rate in wanted.items():
        assert errors[kind] / words[kind] == pytest.approx(rate, rel=0.2), kind


def test_speakers_and_noise_change_the_error_rate_as_measured() -> None:
    profile = measured_errors()

    def errors(circumstances: float) -> float:
        rng, channel = np.random.default_rng(8), AsrChannel(rate=0.05)
        edits = sum(
            Levenshtein.distance(t.split(), channel.transcribe(t, rng, circumstances).split()) for t in SAID * 4
        )
        return edits / sum(len(text.split()) for text in SAID * 4)

    loud = profile.circumstances(Role.PARTICIPANT, Loudness.LOUD)
    quiet = profile.circumstances(Role.CO_WIZARD, Loudness.QUIET)
    assert loud > quiet
    assert errors(loud) / errors(quiet) == pytest.approx(loud / quiet, rel=0.15)


def test_profile_is_written_by_its_script(tmp_path: Path) -> None:
    from benchmarks.recognition_errors import profile
    from dorothie_gym.evaluation.analysis.word_errors import WordErrorCounts, WordErrors

    counts = WordErrorCounts()
    counts.speakers[Role.PARTICIPANT] += WordErrors(words=5000, substitutions=200, deletions=100, insertions=100)
    counts.speakers[Role.CO_WIZARD] += WordErrors(words=5000, substitutions=100)
    counts.noises[Loudness.QUIET] += WordErrors(words=10000, substitutions=300, deletions=100, insertions=100)
    counts.classes[WordClass.COMMON] += WordErrors(words=9990, substitutions=300, deletions=100, insertions=100)
    counts.classes[WordClass.NAME] += WordErrors(words=10)
    found = profile(counts, 3)
    assert found["word_error_rate"] == 0.05 and found["substitutions"] == 0.6 and found["deletions"] == 0.2
    assert found["speakers"] == {"co_wizard": 0.423, "participant": 1.577}
    assert 0.9 < found["word_classes"]["name"] < 1.0, "ten words say little"  # type: ignore[index]
