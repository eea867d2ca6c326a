"""Speech: synthesis, recognition with the language of the sessions, car noise, and understanding of recognised words.

Needs the extra `speech`; the packages are imported when a synthesiser or recogniser is made, and nothing is downloaded.
"""

from dorothie_gym.dialogue import INAUDIBLE
from dorothie_gym.errors import AudioError, SpeechError
from dorothie_gym.speech.audio import (
    SAMPLE_RATE,
    Samples,
    checked_samples,
    encode_flac,
    encode_wav,
    read_audio,
    resample,
)
from dorothie_gym.speech.backends import RECOGNIZER_NAMES, SYNTHESIZER_NAMES, find_recognizer, find_synthesizer
from dorothie_gym.speech.cabin_noise import CabinState, cabin_noise, mixed, pink_noise, signal_to_noise
from dorothie_gym.speech.http_speech import HttpRecognizer, HttpSynthesizer
from dorothie_gym.speech.recognizer import Hypothesis, Recognition, RecognizedWord, Recognizer
from dorothie_gym.speech.spoken_form import spoken_words, written_form
from dorothie_gym.speech.spoken_understanding import SpokenUnderstanding, audible, readable, understand_speech
from dorothie_gym.speech.synthesizer import Synthesizer, Voice, say
from dorothie_gym.speech.whisper_recognizer import WhisperRecognizer

__all__ = [
    "INAUDIBLE",
    "RECOGNIZER_NAMES",
    "SAMPLE_RATE",
    "SYNTHESIZER_NAMES",
    "AudioError",
    "CabinState",
    "HttpRecognizer",
    "HttpSynthesizer",
    "Hypothesis",
    "Recognition",
    "RecognizedWord",
    "Recognizer",
    "Samples",
    "SpeechError",
    "SpokenUnderstanding",
    "Synthesizer",
    "Voice",
    "WhisperRecognizer",
    "audible",
    "cabin_noise",
    "checked_samples",
    "encode_flac",
    "encode_wav",
    "find_recognizer",
    "find_synthesizer",
    "mixed",
    "pink_noise",
    "read_audio",
    "readable",
    "resample",
    "say",
    "signal_to_noise",
    "spoken_words",
    "understand_speech",
    "written_form",
]
