"""Messages of browsers: what is malformed is refused with a reason, and nothing else happens."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.lab.console.messages import MAX_BYTES, MessageError, Say, decode_message
from tests.lab.console.people import Table


def test_a_typed_turn_is_read() -> None:
    assert decode_message('{"k":"say","n":3,"text":"Left."}') == Say(n=3, text="Left.")


@pytest.mark.parametrize(
    "text",
    [
        "", "null", "[]", "{}", '{"k":"fly"}', '{"k":"say","n":1}', '{"k":"say","n":-1,"text":"a"}',
        '{"k":"say","n":1,"text":"a","extra":1}', '{"k":"drive","n":1,"action":"Stop","angle":400}',
        '{"k":"weather","n":1,"parameter":"fog_density","share":NaN}',
        '{"k":"mark","n":1,"landmark":"KFC","x":1e9,"y":0}',
        '{"k":"control","act":"explode"}', "[" * 3000, '{"k":"say","n":1,"text":"' + "a" * 700 + '"}',
    ],
)  # fmt: skip
def test_malformed_messages_are_refused(text: str) -> None:
    with pytest.raises(MessageError):
        decode_message(text)


def test_large_messages_are_refused_before_they_are_read() -> None:
    with pytest.raises(MessageError, match=f"at most {MAX_BYTES}"):
        decode_message(json.dumps({"k": "say", "n": 1, "text": "a" * MAX_BYTES}))


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)
_KINDS = st.sampled_from(
    ["join", "ping", "view", "parse", "say", "correct", "drive", "plan", "goal", "status", "mark", "weather", "prop",
     "move", "remove", "spawn", "fault", "task", "message", "control", "announce"]
)  # fmt: skip
_FIELDS = st.sampled_from(
    ["n", "c", "text", "spans", "action", "angle", "up", "junctions", "landmarks", "landmark", "status", "x", "y",
     "parameter", "share", "prop", "item", "what", "count", "extent", "sensor", "on", "change", "message", "act",
     "rate", "utterance", "span", "move", "slots", "token"]
)  # fmt: skip
_SENSIBLE = st.sampled_from(
    [0, 1, 3, 0.5, True, "KFC", "Stop", "JTurn", "gps", "fog_density", "tree", "trigger", "end", [], {}]
)


@given(kind=_KINDS, fields=st.dictionaries(_FIELDS, _SENSIBLE | _VALUES, max_size=5), seat=st.integers(0, 4))
def test_no_message_brings_a_room_down(kind: str, fields: dict[str, object], seat: int) -> None:
    table = _TABLE
    person = table.people[seat]
    try:
        message = decode_message(json.dumps({"k": kind, **fields}))
    except MessageError:
        return
    table.room.receive(person.seat, person.connection, message)
    table.tick()
    assert len(person.connection.shown) > 5


class _Lazy:
    """Table that is laid when the first message comes."""

    def __init__(self) -> None:
        self._table: Table | None = None

    def __getattr__(self, name: str) -> object:
        if self._table is None:
            self._table = Table(max_seconds=86400.0)
            for seat in ("participant", "co_wizard", "ad_wizard", "experimenter", "spectator"):
                self._table.seat(seat)
            self._table.run(0.5)
        return getattr(self._table, name)


_TABLE: Table = _Lazy()  # type: ignore[assignment]  # behaves like one


def test_ten_thousand_mutated_messages_are_read_or_refused() -> None:
    rng = np.random.default_rng(0)
    sound = [
        b'{"k":"say","n":1,"text":"Left.","spans":[{"text":"Left.","move":"Instruct","slots":{"Action":["JTurn"]}}]}',
        b'{"k":"drive","n":2,"action":"JTurn","angle":-84,"up":true}',
        b'{"k":"join","token":"abc"}',
        b'{"k":"task","n":3,"change":"trigger","item":1,"message":"Hurry."}',
        b'{"k":"view","rate":10}',
    ]
    refused = 0
    for k in range(10_000):
        content = bytearray(sound[k % len(sound)])
        for place in rng.integers(len(content), size=int(rng.integers(1, 6))):
            content[place] = int(rng.integers(256))
        try:
            decode_message(bytes(content))
        except MessageError as error:
            refused += 1
            assert len(str(error)) < 1000
    assert 5_000 < refused < 10_000
