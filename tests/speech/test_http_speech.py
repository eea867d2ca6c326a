"""Synthesis and recognition by a server: a local one, which speaks and listens with the package itself."""

import io
import json
import threading
import wave
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer

import numpy as np
import pytest

from dorothie_gym.errors import SpeechError
from dorothie_gym.speech import HttpRecognizer, HttpSynthesizer, find_recognizer, find_synthesizer, say


class Handler(BaseHTTPRequestHandler):
    requests: list[tuple[str, dict[str, str], bytes]]
    answers: dict[str, tuple[int, bytes]]

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.requests.append((self.path, dict(self.headers), body))
        status, answer = self.answers.get(self.path) or (200, self.made(body))
        self.send_response(status)
        self.send_header("Content-Length", str(len(answer)))
        self.end_headers()
        self.wfile.write(answer)

    def made(self, body: bytes) -> bytes:
        if self.path.endswith("/speech"):
            asked = json.loads(body)
            samples = find_synthesizer().synthesize(asked["input"], rate=asked["speed"], seed=asked["seed"])
            return wav(samples, find_synthesizer().sample_rate)
        start = body.index(b"RIFF")
        with wave.open(io.BytesIO(body[start:])) as file:
            samples = np.frombuffer(file.readframes(file.getnframes()), "<i2")
            found = find_recognizer().recognize(samples, file.getframerate())  # type: ignore[arg-type]
        words = [{"word": word.text, "start": word.start, "end": word.end} for word in found.words]
        return json.dumps({"text": found.text.capitalize() + ".", "words": words}).encode()

    def log_message(self, *_: object) -> None:
        pass


def wav(samples: np.ndarray, rate: int) -> bytes:
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes((samples * 32767).astype("<i2").tobytes())
    return buffer.getvalue()


@pytest.fixture
def server() -> Iterator[tuple[str, type[Handler]]]:
    handler = type("Server", (Handler,), {"requests": [], "answers": {}})
    running = HTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=running.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{running.server_port}/v1/", handler
    running.shutdown()
    thread.join()
    running.server_close()


def test_text_is_spoken_and_recognised_by_a_server(server: tuple[str, type[Handler]]) -> None:
    url, handler = server
    wanted = say(find_synthesizer(), "Turn left at the KFC.", seed=2)
    find_recognizer()  # loaded before the server has to answer in time
    samples = HttpSynthesizer(url, "voice-model", ["anna"], key="secret").synthesize("Turn left at the KFC.", seed=2)
    assert samples.dtype == np.float32
    assert len(samples) == pytest.approx(len(wanted), abs=2)
    found = HttpRecognizer(url, "ear-model", key="secret").recognize(samples, 16000, hints=["KFC", "Beal"])
    assert found.text == "turn left at the k f c"
    assert [word.text for word in found.words] == found.text.split()
    assert found.hypotheses[0].weight == 1.0
    (_, headers, asked), (path, _, form) = handler.requests
    assert headers["Authorization"] == "Bearer secret"
    assert json.loads(asked)["voice"] == "anna"
    assert path == "/v1/audio/transcriptions"
    assert b"ear-model" in form
    assert b"KFC, Beal" in form


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        ((500, b"out of\nmemory"), "status 500: out of memory"),
        ((200, b"no json"), "the server's answer cannot be read"),
        ((200, b"[]"), "is no JSON object"),
        ((200, b'{"text": 3}'), "has no field 'text'"),
    ],
)
def test_faulty_answers_are_reported(
    server: tuple[str, type[Handler]], answer: tuple[int, bytes], message: str
) -> None:
    url, handler = server
    handler.answers["/v1/audio/transcriptions"] = answer
    with pytest.raises(SpeechError, match=message):
        HttpRecognizer(url, "m").recognize(np.full(1600, 0.1, np.float32), 16000)


def test_answer_without_audio_is_reported(server: tuple[str, type[Handler]]) -> None:
    url, handler = server
    handler.answers["/v1/audio/speech"] = (200, b"<html>")
    with pytest.raises(SpeechError, match="the server sent no WAV file"):
        HttpSynthesizer(url, "m", ["a"]).synthesize("Hello.")


def test_missing_server_and_wrong_addresses_are_reported() -> None:
    with pytest.raises(SpeechError, match=r"http://127.0.0.1:9/audio/transcriptions: no answer"):
        HttpRecognizer("http://127.0.0.1:9", "m", timeout=2.0).recognize(np.full(1600, 0.1, np.float32), 16000)
    with pytest.raises(ValueError, match="it must begin with http"):
        HttpRecognizer("localhost:80", "m")
    with pytest.raises(ValueError, match="voices is empty"):
        HttpSynthesizer("http://localhost", "m", [])
