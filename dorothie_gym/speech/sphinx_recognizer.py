"""Recognition by pocketsphinx with the language of the sessions, on one processor core and without network."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from dorothie_gym.errors import SpeechError
from dorothie_gym.speech.hibari_synthesizer import hibari
from dorothie_gym.speech.language import SpokenLanguage, load_language
from dorothie_gym.speech.recognizer import Hypothesis, Recognition, RecognizedWord
from dorothie_gym.speech.spoken_form import spoken_words
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.audio import SAMPLE_RATE, Samples, checked_samples, resample, to_pcm
from dorothie_gym.support.optional_modules import speech_module

FRAMES_PER_SECOND: Final = 100
"""Frames of the recogniser per second."""

PADDING: Final = 0.12
"""Silence around the audio [s]; the decoder needs some at both ends, but too much spoils the normalisation
of noisy audio. On 400 spans in the noise of the car, the word error rate is 3.9 % with 0.25 s and 3.2 % with 0.12 s."""

LEVEL: Final = 0.08
"""Root mean square to which audio is scaled; the features are normalised, so only rounding depends on it."""

HYPOTHESES: Final = 10
"""Number of distinct hypotheses."""

_SEARCHED: Final = 60
"""Hypotheses of the decoder that are searched for distinct ones: many differ in pronunciation or silence only."""

_SCORE_SCALE: Final = 1000.0
"""Exponent of the decoder's path scores, which it returns compressed: their ratios are close to 1 otherwise."""

_NO_MODEL: Final = "{path}: is missing or damaged; pip install --force-reinstall pocketsphinx"

_HINT_BONUS: Final = 1.5
"""Factor on the weight of a hypothesis for each hinted name in it."""


class SphinxRecognizer:
    """Recogniser by pocketsphinx (BSD) with its American acoustic model.

    Args:
        language: language model and dictionary; that of the sessions if None, built on the first use and cached.

    Raises:
        SpeechError: the extra `speech` is not installed, or the acoustic model is missing or damaged.
    """

    def __init__(self, language: SpokenLanguage | None = None) -> None:
        sphinx = speech_module("pocketsphinx")
        models = Path(str(sphinx.get_model_path())) / "en-us"
        words = models / "cmudict-en-us.dict"
        if not words.is_file():
            raise SpeechError(_NO_MODEL.format(path=words))
        if language is None:
            language = load_language(words, _phonemes)
        with tempfile.TemporaryDirectory(prefix="dorothie_gym.") as name:
            arpa, dictionary = Path(name) / "language.arpa", Path(name) / "words.dict"
            arpa.write_text(language.arpa, encoding="utf-8")
            dictionary.write_text(language.dictionary, encoding="utf-8")
            try:
                self._decoder: Any = sphinx.Decoder(
                    hmm=str(models / "en-us"),
                    lm=str(arpa),
                    dict=str(dictionary),
                    loglevel="FATAL",
                    # the second pass over the words of the first takes a third of the time and corrects nothing: on
                    # 120 spans in the noise of the car, the word error rate is 5.1 % with it and 4.8 % without
                    fwdflat=False,
                )
            except RuntimeError as error:  # it does not report which file
                raise SpeechError(_NO_MODEL.format(path=models / "en-us")) from error

    def recognize(self, samples: Samples, sample_rate: int, *, hints: Sequence[str] = ()) -> Recognition:
        """Returns the words of an audio; see `Recognizer.recognize`."""
        audio = resample(checked_samples(samples, sample_rate), sample_rate)
        loudness = float(np.sqrt(np.mean(np.square(audio))))
        if loudness == 0.0:
            return Recognition(text="")
        self._decode(_padded(audio * np.float32(LEVEL / loudness)))
        words = self._words()
        if not words:
            return Recognition(text="")
        found = _with_hints(self._hypotheses(" ".join(word.text for word in words)), hints)
        if found[0].text != " ".join(word.text for word in words):
            words = ()  # times and confidences belong to the decoder's best words
        return Recognition(text=found[0].text, words=words, hypotheses=found)

    def _decode(self, audio: Samples) -> None:
        decoder = self._decoder
        decoder.reinit_feat()  # clears the mean of the previous audio
        decoder.start_utt()
        decoder.process_raw(to_pcm(audio).astype("<i2").tobytes(), full_utt=True)
        decoder.end_utt()

    def _words(self) -> tuple[RecognizedWord, ...]:
        return tuple(
            RecognizedWord(
                text=_bare(segment.word),
                start=max(segment.start_frame / FRAMES_PER_SECOND - PADDING, 0.0),
                end=max((segment.end_frame + 1) / FRAMES_PER_SECOND - PADDING, 0.0),
                confidence=min(max(float(segment.prob), 0.0), 1.0),
            )
            for segment in self._decoder.seg() or ()
            if segment.word[0] not in "<["
        )

    def _hypotheses(self, best: str) -> tuple[Hypothesis, ...]:
        scores = {best: 0.0}
        top: float | None = None
        for found in islice(self._decoder.nbest() or (), _SEARCHED):
            if found is None or not found.hypstr:  # the lattice has no further path
                break
            text = " ".join(_bare(word) for word in found.hypstr.split() if word[0] not in "<[")
            score = pm.log(max(float(found.score), 1e-300))
            top = score if top is None else top
            if text and len(scores) < HYPOTHESES:
                scores.setdefault(text, score - top)
        weights = {text: pm.exp(_SCORE_SCALE * score) for text, score in scores.items()}
        total = sum(weights.values())
        return tuple(Hypothesis(text=text, weight=weight / total) for text, weight in weights.items())


def _with_hints(found: Sequence[Hypothesis], hints: Sequence[str]) -> tuple[Hypothesis, ...]:
    """Returns hypotheses with more weight for those that contain hinted names, sorted by weight."""
    names = [f" {' '.join(spoken_words(hint))} " for hint in hints]
    weights = [each.weight * _HINT_BONUS ** sum(name in f" {each.text} " for name in names) for each in found]
    total = sum(weights)
    weighted = [Hypothesis(text=each.text, weight=w / total) for each, w in zip(found, weights, strict=True)]
    return tuple(sorted(weighted, key=lambda each: -each.weight))


def _padded(audio: Samples) -> Samples:
    """Returns audio with faint noise around it: digital silence cannot be a frame of any sound."""
    silence = np.random.default_rng(0).standard_normal(round(PADDING * SAMPLE_RATE)).astype(np.float32) * np.float32(
        1e-4
    )
    return np.concatenate([silence, audio, silence])


def _bare(word: str) -> str:
    """Returns a word of the dictionary without the number of its pronunciation."""
    return word.partition("(")[0]


def _phonemes(text: str) -> str:
    return hibari().phonemes(text)
