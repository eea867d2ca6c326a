"""Small sessions made in code."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology import DialogueAct, PhysicalAction, Role
from dorothie_gym.session.recording import Event, EventType, Session, SessionHeader, SessionWriter, trajectory_of
from dorothie_gym.sim.config import FRAME_RATE


def header(**changes: Any) -> SessionHeader:
    fields: dict[str, Any] = {
        "town": "crossing",
        "storyboard": "errand",
        "seed": 7,
        "decision_frequency": 2.0,
        "street_names": ("Baits", "Fuller"),
        "landmarks": (
            {"name": "KFC", "lane": 3, "station": 12.5, "x": 10.0, "y": -4.0, "street": 0, "hidden": False},
            {"name": "House", "lane": 5, "station": 1.0, "x": 90.0, "y": 44.0, "street": 1, "hidden": True},
        ),
        "subgoals": (
            {"description": "lunch", "landmark": 0, "after": [], "trigger": False, "delete": False, "change": None},
            {"description": "home", "landmark": 1, "after": [0], "trigger": False, "delete": True, "change": "shop"},
        ),
        "story": "Hungry people go home.",
        "departure": (2, 8.25),
        "config": {"traffic": 8, "nested": {"b": 1.5, "a": [1, 2]}},
    }
    return SessionHeader(**{**fields, **changes})


def utterance(
    frame: int, speaker: Role, number: int, *spans: tuple[str, DialogueAct], flagged: bool = True, seconds: float = 1.0
) -> list[Event]:
    """The events of one utterance that is over at `frame`."""
    text = " ".join(words for words, _ in spans)
    return [
        Event(
            frame=frame,
            type=EventType.DIALOGUE_MOVE,
            source=speaker,
            flagged=flagged,
            data={
                "utterance": number,
                "text": text,
                "span": words,
                "move": act.move.label,
                "slots": act.slot_labels(),
                "exchange": 0,
                "start": frame / FRAME_RATE - seconds,
                "end": frame / FRAME_RATE,
            },
        )
        for words, act in spans
    ]


def physical(
    frame: int, action: PhysicalAction, angle: float | None = None, up: bool | None = None, flagged: bool = True
) -> Event:
    return Event(
        frame=frame,
        type=EventType.PHYSICAL_ACTION,
        source=Role.CO_WIZARD,
        flagged=flagged,
        data={"action": action.label, "angle": angle, "up": up},
    )


def rows(first: int, count: int) -> NDArray[np.float64]:
    """Rows (count, 9) of a car that drives east at 6 m/s."""
    frames = np.arange(first, first + count, dtype=np.float64)
    columns = [frames, frames / 5, frames * 0, frames * 0 + 0.1, frames * 0 + 6.0, frames * 0 + 0.3, frames * 0]
    return np.stack([*columns, frames * 0, frames // 50], axis=1)


def session(events: Sequence[Event] = (), frames: int = 300, name: str = "one", **changes: Any) -> Session:
    return Session(header=header(**changes), events=tuple(events), trajectory=trajectory_of(rows(0, frames)), name=name)


def write(folder: Path, events: Sequence[Event] = (), frames: int = 300, **changes: Any) -> Path:
    with SessionWriter(folder, header(**changes)) as writer:
        writer.append(events, rows(0, frames))
        writer.finish({"success": True, "seconds": 1.5})
    return folder
