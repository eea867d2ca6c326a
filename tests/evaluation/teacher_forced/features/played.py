"""Sessions that the scripted roles played, and how they are rewritten from a moment on."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from dorothie_gym.archive import Task
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.evaluation.teacher_forced.features import Batch, Columns
from dorothie_gym.ontology import AGENT_ROLES, DialogueAct, DialogueMove, LandmarkName, PhysicalAction, Role, StreetName
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Event, EventType, SceneTable, Session
from tests.session.recording.builders import physical, utterance

LATER = DialogueAct.of(DialogueMove.CONFUSE, LandmarkName.IKEA, StreetName.FULLER)


def play(folder: Path, *, seed: int = 0, seconds: float = 60.0, town: str = "brookside") -> Session:
    """Plays and reads a session."""
    env = DuoWizardEnv(town, config=EnvConfig(max_seconds=seconds))
    play_session(
        env, {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}, seed=seed, folder=folder
    )
    return Session.load(folder)


def with_another_future(session: Session, index: int, task: Task, *, strict: bool = False) -> Session:
    """Rewrites all that is recorded in or after the tenth of an event, the event itself too.

    What the rule of the task shows stays: the words of the point's utterance and the acts of its earlier spans (UfN),
    or those spans alone (RfN; under the strict rule not even they).
    """
    words = task is Task.UFN
    point = session.events[index]
    first = point.frame - point.frame % 3
    events = []
    for number, event in enumerate(session.events):
        if event.frame < first:
            events.append(event)
        elif words and _said_together(event, point) and number <= index:
            events.append(event if number < index else _other_act(event))
        elif task is Task.RFN and not strict and _said_together(event, point) and number < index:
            events.append(replace(event, data={**event.data, "text": "other words", "end": 4242.0}))
        elif number < index and _heard_before(event, point):
            events.append(event)
        elif number <= index:
            events.append(_other(event, point if number == index else None))
    last = max((event.frame for event in session.events), default=0)
    if words:
        rest = [event for event in session.events[index + 1 :] if _said_together(event, point)]
        events += [_other_act(event) for event in rest]
    for frame in range(first + 3, last + 400, 60):
        events += utterance(frame, Role.CO_WIZARD, 1000 + frame, ("Nothing of this was said.", LATER))
        events.append(physical(frame, PhysicalAction.LANE_SWITCH, angle=90.0))
    header = session.header
    hidden = [replace_row(row, x=row["x"] + 9.0, lane=0) if row["hidden"] else row for row in header.landmarks]
    return replace(
        session,
        header=replace(
            header, seed=99, storyboard="other", story="Another story.", subgoals=(), landmarks=hidden, config={},
            departure=(0, 0.0), decision_frequency=1.0,
        ),
        events=tuple(events),
        trajectory=_other_way(session.trajectory, first),
        scene=replace(session.scene, **{name: _others(getattr(session.scene, name), first) for name in _TABLES}),
        summary={"success": None, "reason": "other"},
        complete=False,
    )  # fmt: skip


def replace_row(row: Any, **changes: Any) -> Any:
    return {**row, **changes}


_TABLES = ("actors", "lights", "weather")


def _heard_before(event: Event, point: Event) -> bool:
    """Whether an event of the tenth of a point, and before it, is one of words that an action may follow at once."""
    return point.type is EventType.PHYSICAL_ACTION and event.type is EventType.DIALOGUE_MOVE


def _said_together(event: Event, point: Event) -> bool:
    return (
        event.type is EventType.DIALOGUE_MOVE is point.type
        and event.source is point.source
        and event.data["utterance"] == point.data["utterance"]
    )


def _other_act(event: Event) -> Event:
    return replace(
        event, data={**event.data, "move": LATER.move.label, "slots": LATER.slot_labels(), "span": "other words"}
    )


def _other(event: Event, point: Event | None) -> Event:
    """Something else in its place; at the point itself still a point of the same task."""
    if point is None:
        return Event(frame=event.frame, type=EventType.MESSAGE, source=Role.AD_WIZARD, data={"text": "other"})
    if event.type is EventType.DIALOGUE_MOVE:
        return replace(_other_act(event), data={**_other_act(event).data, "text": "other words"})
    return replace(event, data={"action": PhysicalAction.U_TURN.label, "angle": None, "up": None})


def _other_way(trajectory: Any, first: int) -> Any:
    changed = trajectory.copy()
    later = changed["frame"] >= first
    for name in ("x", "y", "heading", "speed"):
        changed[name][later] += 77.0
    changed["lane"][later] = 0
    return changed[: len(changed) - later.sum() // 3]


def _others(table: SceneTable, first: int) -> SceneTable:
    """The same table with other numbers in it from a frame on."""
    rows = table.rows.copy()
    later = rows[table.offsets[np.searchsorted(table.frames, first)] :]
    for name in rows.dtype.names or ():
        if name == "state":
            later[name] = (later[name] + 1) % 3
        elif name not in ("key", "kind", "signal"):
            later[name] += 5.0
    return SceneTable(table.frames, table.offsets, rows)


def seen(columns: Columns, batch: Batch) -> dict[str, Any]:
    """Returns the fields of a batch with texts as words, since their numbers depend on other texts."""
    words = np.array([*columns.texts, ""], dtype=object)  # -1 is the last
    found = {}
    for field in fields(batch):
        values = getattr(batch, field.name)
        found[field.name] = words[values] if field.name.endswith(("text", "recognised")) else values
    return found
