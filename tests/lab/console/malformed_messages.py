"""Messages of browsers, values that their fields may not have, and the refusals that are to follow."""

from __future__ import annotations

import json
from typing import Any

SOUND = (
    {"k": "say", "n": 1, "text": "Left.", "spans": [{"text": "Left.", "move": "Instruct", "slots": {}}]},
    {"k": "parse", "c": 1.0, "text": "Left."},
    {"k": "correct", "utterance": 0, "span": 0, "move": "Instruct"},
    {"k": "drive", "n": 1, "action": "JTurn", "angle": 90, "up": True},
    {"k": "plan", "n": 1, "junctions": [1, 2]},
    {"k": "goal", "n": 1, "landmarks": ["KFC"]},
    {"k": "status", "n": 1, "landmark": "KFC", "status": "Complete"},
    {"k": "mark", "n": 1, "landmark": "KFC", "x": 1.0, "y": 2.0},
    {"k": "weather", "n": 1, "parameter": "fog_density", "share": 0.5},
    {"k": "prop", "n": 1, "prop": "tree", "x": 1.0, "y": 2.0},
    {"k": "move", "n": 1, "item": 0, "x": 1.0, "y": 2.0},
    {"k": "spawn", "n": 1, "what": "vehicles", "x": 1.0, "y": 2.0, "count": 4},
    {"k": "fault", "n": 1, "sensor": "gps", "on": True},
    {"k": "task", "n": 1, "change": "trigger", "item": 0},
    {"k": "message", "n": 1, "text": "Hello."},
    {"k": "control", "act": "pause"},
    {"k": "announce", "text": "Hello."},
    {"k": "view", "rate": 5},
)

_NUMBERS = [None, {}, [{}], "1", 10**40, -(10**40), "x" * 9000]
_TEXTS = [None, {}, [{}], 10**40, True, "x" * 9000]
_LABELS = "k", "action", "landmark", "move", "parameter", "prop", "sensor", "what", "change", "act"
STRICT: dict[str, Any] = {
    **{name: [*_NUMBERS, -1, 1.5, 2**40] for name in ("n", "utterance", "item", "count", "rate")},
    **{name: [*_NUMBERS, 1e300, -1e300] for name in ("x", "y", "share")},
    **{name: [*_TEXTS, "", "nonsense", "\x00", "../..", "\ud800"] for name in _LABELS},
    "text": _TEXTS,
    "junctions": [None, {}, "1", [1.5], ["x"], [-1], [10**40]],
    "on": [None, {}, 1, "yes"],
    "landmarks": [None, {}, "KFC", [1], [None]],
}
"""Fields of messages, and values of which none is allowed."""


def refusals(socket: Any, count: int) -> None:
    """Reads refusals up to a number; other messages must be of the session."""
    while count:
        message = json.loads(socket.recv(timeout=30))
        assert message["k"] in ("hello", "frame", "refused"), message
        if message["k"] == "refused":
            assert message["reason"] and "\n" not in message["reason"] and len(message["reason"]) < 1500
            count -= 1
