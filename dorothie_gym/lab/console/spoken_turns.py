"""Speech at the seats: recognition of people's speech, and synthesis of the utterances that they hear.

The browser sends audio by HTTP with the secret of its seat; the websocket carries the utterances, as typed text.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Final, TypeAlias

import numpy as np
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from dorothie_gym.lab.console.room import Room
from dorothie_gym.lab.console.seat import Seat
from dorothie_gym.lab.gate import RequestError, bearer_token, receive_body
from dorothie_gym.lab.protocols import recognise
from dorothie_gym.ontology.roles import Role
from dorothie_gym.speech.backends import find_recognizer, find_synthesizer
from dorothie_gym.speech.spoken_understanding import readable
from dorothie_gym.speech.synthesizer import Voice, say
from dorothie_gym.support.audio import SAMPLE_RATE, encode_flac, encode_wav

LONGEST_TURN: Final = 30.0
"""Longest turn that is recognised [s]."""

MAX_BYTES: Final = round(LONGEST_TURN * SAMPLE_RATE) * 2
"""Largest recording [bytes]: 16-bit samples, little-endian, 16 kHz, mono."""

SHORTEST_TURN: Final = 0.15
"""Shortest recording that is recognised [s]; a shorter one is a key that was touched."""

PITCHES: Final = {Role.PARTICIPANT: 0.9, Role.CO_WIZARD: 0.95}
"""Pitch of the voice of each role, within the ranges of spoken sessions."""

Find: TypeAlias = Callable[[str], tuple[Room, Seat] | None]


class SpokenTurns:
    """Recognition and synthesis for the seats of a server, in one thread next to the event loop.

    Args:
        find: returns room and seat of a secret; None for an unknown one.

    Raises:
        SpeechError: the extra `speech` is not installed.
    """

    def __init__(self, find: Find) -> None:
        find_recognizer()  # slow, and reported before a person speaks
        find_synthesizer()
        self._find = find
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="speech")
        self._busy: set[str] = set()

    def routes(self) -> list[Route]:
        """Returns the routes: `/speech/heard` takes a recording, `/speech/said/LINE` speaks a line of the talk."""
        return [
            Route("/speech/heard", self._heard, methods=["POST"]),
            Route("/speech/said/{line:int}", self._said, methods=["GET"]),
        ]

    def close(self) -> None:
        """Ends the thread."""
        self._thread.shutdown(wait=False, cancel_futures=True)

    async def _heard(self, request: Request) -> Response:
        """Answers with the text that was recognised, and the name of the recording if it is kept."""
        room, seat = self._seat(request)
        if seat.token in self._busy:
            raise RequestError(429, "the last recording is still being recognised")
        self._busy.add(seat.token)
        try:
            content = await receive_body(request, MAX_BYTES, f"a recording has at most {LONGEST_TURN:.0f} s")
            if len(content) % 2:
                raise RequestError(400, "a recording consists of 16-bit samples, 16 kHz, mono")
            loop = asyncio.get_running_loop()
            answer = await loop.run_in_executor(self._thread, _recognise, room, seat, content)
        finally:
            self._busy.discard(seat.token)
        return JSONResponse(answer)

    async def _said(self, request: Request) -> Response:
        """Answers with a line of the talk that the seat heard, spoken, as WAV."""
        _, seat = self._seat(request)
        entries, line = seat.talk.entries, int(request.path_params["line"])
        speakers = {role.value: role for role in PITCHES if role is not seat.role}
        if line >= len(entries) or entries[line]["who"] not in speakers:
            raise RequestError(404, "there is no such line of another speaker")
        role, text = speakers[entries[line]["who"]], str(entries[line]["text"])
        loop = asyncio.get_running_loop()
        content = await loop.run_in_executor(self._thread, _spoken, text, role)
        return Response(content, media_type="audio/wav", headers={"Cache-Control": "no-store"})

    def _seat(self, request: Request) -> tuple[Room, Seat]:
        """Returns room and seat of the secret in the header `Authorization`; only roles that talk have speech."""
        found = self._find(bearer_token(request))
        if found is None or found[1].role not in PITCHES:
            raise RequestError(403, "no seat that talks has this secret")
        recognise(request)
        return found


def _recognise(room: Room, seat: Seat, content: bytes) -> dict[str, object]:
    samples = np.frombuffer(content, "<i2").astype(np.float32) / np.float32(32768.0)
    if len(samples) < SHORTEST_TURN * SAMPLE_RATE:
        return {"text": "", "confidence": None, "audio": None}
    streets = room.engine.scenario.street_labels
    heard = find_recognizer().recognize(samples, SAMPLE_RATE, hints=streets)
    sure = [word.confidence for word in heard.words if not math.isnan(word.confidence)]
    text = readable(heard.text) if heard.text else ""
    audio = None if not text else room.keep_audio(seat, encode_flac(samples))
    return {"text": text, "confidence": round(float(np.mean(sure)), 3) if sure else None, "audio": audio}


def _spoken(text: str, role: Role) -> bytes:
    return encode_wav(say(find_synthesizer(), text, Voice(pitch=PITCHES[role])))
