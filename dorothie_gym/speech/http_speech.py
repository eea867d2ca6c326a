"""Synthesis and recognition by a server with the audio routes of OpenAI's interface."""

from __future__ import annotations

import io
import wave
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from dorothie_gym.errors import SpeechError, one_line
from dorothie_gym.speech.recognizer import Recognition, RecognizedWord, single_hypothesis
from dorothie_gym.speech.spoken_form import spoken_words
from dorothie_gym.speech.synthesizer import check_request
from dorothie_gym.support.audio import LONGEST, SAMPLE_RATE, Samples, checked_samples, encode_wav, resample
from dorothie_gym.support.optional_modules import speech_module

TIMEOUT: Final = 30.0
"""Time for an answer of the server [s]."""

_LARGEST_ANSWER: Final = round(LONGEST) * 96000 * 2 + 1000
"""Largest answer that is read [bytes]: the longest audio in 16 bits at the highest rate."""


class _Server:
    """Server of audio routes; a connection is made for each request, none before."""

    def __init__(self, url: str, key: str, timeout: float) -> None:
        if not url.startswith(("http://", "https://")):
            raise ValueError(f"url is {url!r}; it must begin with http:// or https://")
        self._url = url.rstrip("/")
        self._headers = {"Authorization": f"Bearer {key}"} if key else {}
        self._timeout = timeout
        self._httpx: Any = speech_module("httpx", extra="")

    def post(self, route: str, **content: Any) -> bytes:
        """Returns the body of the answer to a request; raises `SpeechError` if there is none, or it is an error."""
        url = f"{self._url}/{route}"
        try:
            with (
                self._httpx.Client(timeout=self._timeout) as client,
                client.stream("POST", url, headers=self._headers, **content) as answer,
            ):
                body = b""
                for block in answer.iter_bytes():
                    body += block
                    if len(body) > _LARGEST_ANSWER:
                        raise SpeechError(f"{url}: the answer has more than {_LARGEST_ANSWER} bytes")
                status = answer.status_code
        except self._httpx.HTTPError as error:
            raise SpeechError(f"{url}: no answer: {one_line(error) or type(error).__name__}") from error
        if status != 200:
            raise SpeechError(f"{url}: status {status}: {one_line(body.decode(errors='replace'))}")
        return body


class HttpSynthesizer:
    """Synthesiser by the route `audio/speech`.

    Args:
        url: address before the route, such as "http://localhost:8000/v1".
        model: name of the model.
        voices: names of the voices of the server; the first is the default.
        key: secret for the header `Authorization`; empty if there is none.
        timeout: time for an answer [s].

    Raises:
        ValueError: `url` is not an address, or there are no voices.
        SpeechError: httpx is not installed.
    """

    def __init__(self, url: str, model: str, voices: Sequence[str], *, key: str = "", timeout: float = TIMEOUT) -> None:
        if not voices:
            raise ValueError("voices is empty; name at least one voice of the server")
        self._server, self._model = _Server(url, key, timeout), model
        self.voices = tuple(voices)
        self.sample_rate = SAMPLE_RATE

    def synthesize(self, text: str, *, voice: str = "", rate: float = 1.0, seed: int = 0) -> Samples:
        """Returns a spoken text at 16 kHz; see `Synthesizer.synthesize`. Servers may ignore the seed."""
        check_request(text, rate)
        request = {
            "model": self._model,
            "input": text,
            "voice": voice or self.voices[0],
            "speed": rate,
            "seed": seed,
            "response_format": "wav",
        }
        body = self._server.post("audio/speech", json=request)
        try:
            with wave.open(io.BytesIO(body)) as file:
                if file.getsampwidth() != 2:
                    raise SpeechError(f"the server sent samples of {8 * file.getsampwidth()} bits; 16 are read")
                rate_sent, channels = file.getframerate(), file.getnchannels()
                samples = np.frombuffer(file.readframes(file.getnframes()), dtype="<i2").reshape(-1, channels)
        except (wave.Error, EOFError, ValueError) as error:
            raise SpeechError(f"the server sent no WAV file: {one_line(error)}") from error
        return resample(checked_samples(samples, rate_sent, "the server's audio"), rate_sent, SAMPLE_RATE)


class HttpRecognizer:
    """Recogniser by the route `audio/transcriptions`.

    Args:
        url: address before the route, such as "http://localhost:8000/v1".
        model: name of the model.
        key: secret for the header `Authorization`; empty if there is none.
        timeout: time for an answer [s].

    Raises:
        ValueError: `url` is not an address.
        SpeechError: httpx is not installed.
    """

    def __init__(self, url: str, model: str, *, key: str = "", timeout: float = TIMEOUT) -> None:
        self._server, self._model = _Server(url, key, timeout), model

    def recognize(self, samples: Samples, sample_rate: int, *, hints: Sequence[str] = ()) -> Recognition:
        """Returns the words of an audio; see `Recognizer.recognize`. Hints are sent as the prompt."""
        audio = resample(checked_samples(samples, sample_rate), sample_rate, SAMPLE_RATE)
        form = {
            "model": self._model,
            "language": "en",
            "temperature": "0",
            "response_format": "verbose_json",
            "timestamp_granularities[]": "word",
        }
        if hints:
            form["prompt"] = ", ".join(hints)
        body = self._server.post(
            "audio/transcriptions", data=form, files={"file": ("speech.wav", encode_wav(audio), "audio/wav")}
        )
        return _transcription(body)


def _transcription(body: bytes) -> Recognition:
    """Returns the recognition of an answer in JSON; words without times are left out.

    Raises:
        SpeechError: the answer has no text.
    """
    answer = parse_answer(body)
    text = answer.get("text")
    if not isinstance(text, str):
        raise SpeechError("the server's answer has no field 'text'")
    found = single_hypothesis(" ".join(spoken_words(text)))
    listed = answer.get("words")
    words = []
    for entry in listed if isinstance(listed, list) else ():
        if isinstance(entry, dict) and all(isinstance(entry.get(name), int | float) for name in ("start", "end")):
            words += [
                RecognizedWord(text=word, start=float(entry["start"]), end=float(entry["end"]), confidence=float("nan"))
                for word in spoken_words(str(entry.get("word", "")))
            ]
    return Recognition(text=found.text, words=tuple(words), hypotheses=found.hypotheses)


def parse_answer(body: bytes) -> dict[str, Any]:
    """Returns the JSON object of an answer; raises `SpeechError` if it is none."""
    from dorothie_gym.support.input_files import parse_json

    try:
        answer = parse_json(body.decode("utf-8"), "the server's answer")
    except ValueError as error:
        raise SpeechError(f"the server's answer cannot be read: {one_line(error)}") from error
    if not isinstance(answer, dict):
        raise SpeechError("the server's answer is no JSON object")
    return answer
