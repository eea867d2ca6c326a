"""Honest rollouts of the tests, and edits of their files that leave files which agree with each other.

Sessions are saved again with their counts, and the result is measured again from them (`measured_again`).
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dorothie_gym.evaluation.closed_loop import RolloutResult, RolloutSettings, measure, read_result
from dorothie_gym.evaluation.closed_loop.protocol import LeaderboardProtocol
from dorothie_gym.evaluation.closed_loop.usage import usage_to_json
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, Player
from dorothie_gym.policies.language_model.usage import ModelUsage
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Decision, Event, EventType, Session
from dorothie_gym.session.recording.files import to_page

CONFIG = EnvConfig(max_seconds=15.0)
PROTOCOL = LeaderboardProtocol(sessions=3, config=CONFIG)
"""Protocol of the rollout that is edited afterwards."""

LONGER = EnvConfig(max_seconds=120.0)
ONE = LeaderboardProtocol(sessions=1, config=LONGER)
"""Protocol of the rollouts that are played by cheats; the Ad-Wizard acts in its session."""


def settings(**changes: Any) -> RolloutSettings:
    cast = {**ALL_SCRIPTED, Role.CO_WIZARD: Player(name="lane-follow")}
    return RolloutSettings(**{"cast": cast, "towns": ("brookside",), "sessions": 3, "config": CONFIG, **changes})


# --- Files ------------------------------------------------------------------------------------------------------------


def edit(file: Path, change: Callable[[Any], object]) -> None:
    page = json.loads(file.read_text())
    change(page)
    file.write_text(json.dumps(page))


def edit_settings(folder: Path, change: Callable[[Any], object]) -> None:
    """Changes the settings in both files that have them."""
    edit(folder / "rollout.json", lambda page: change(page["settings"]))
    edit(folder / "settings.json", change)


def sessions_of(folder: Path) -> list[Path]:
    return sorted((folder / "sessions").iterdir())


def measured_again(folder: Path) -> None:
    """Writes the result that the sessions give, as if the rollout had been like this."""
    result = read_result(folder)
    rows = []
    for row in result.rows:
        (path,) = (folder / "sessions").glob(f"{row.number:04d}-*")
        record = measure(Session.load(path), load_town(row.town))
        rows.append(replace(row, record=record))
    (folder / "rollout.json").write_text(to_page(RolloutResult(settings=result.settings, rows=tuple(rows)).to_json()))


def resave(path: Path, change: Callable[[Session], Session]) -> None:
    """Saves a changed session in place of another one, and the result that it gives."""
    session = change(Session.load(path))
    shutil.rmtree(path)
    session.save(path)
    measured_again(path.parents[1])


def change_session(change: Callable[[Session], Session]) -> Callable[[Path], None]:
    return lambda folder: resave(sessions_of(folder)[0], change)


def change_header(**fields: Any) -> Callable[[Path], None]:
    return change_session(lambda session: replace(session, header=replace(session.header, **fields)))


def change_record(**fields: Any) -> Callable[[Path], None]:
    return lambda folder: edit(folder / "rollout.json", lambda page: page["rows"][1]["record"].update(**fields))


def with_event(session: Session, number: int, event: Event | None) -> Session:
    """The session with another event in the place of one, or without that one."""
    events = list(session.events)
    events[number : number + 1] = [] if event is None else [event]
    return replace(session, events=tuple(events))


def end_of(session: Session, **data: Any) -> Session:
    """The session with other data of its end, in event and outcome."""
    last = session.events[-1]
    assert last.type is EventType.END
    changed = with_event(session, len(session.events) - 1, replace(last, data={**last.data, **data}))
    return replace(changed, summary={**(session.summary or {}), **data})


def cut(session: Session, seconds: float, *, end: float | None = None) -> Session:
    """The session as if its time had been over earlier; with the event of its end at another time, if one is given."""
    last = round(seconds * 30)
    over = replace(session.events[-1], frame=round((seconds if end is None else end) * 30))
    kept = session.trajectory["frame"] <= last
    scene, frames = session.scene, np.arange(last + 1)
    tables = {name: getattr(scene, name).at_frames(frames) for name in ("actors", "lights", "weather")}
    return replace(
        session,
        events=(*(event for event in session.events[:-1] if event.frame <= last), over),
        trajectory=session.trajectory[kept],
        scene=replace(scene, **tables),
        decisions=tuple(decision for decision in session.decisions or () if decision.frame < last),
        summary={**(session.summary or {}), "seconds": seconds},
    )


def moved(session: Session) -> Session:
    """The session with the last bits of one number of its frames changed."""
    trajectory = session.trajectory.copy()
    trajectory["x"][200] += 1e-9
    return replace(session, trajectory=trajectory)


def without_actors(session: Session) -> Session:
    actors = session.scene.actors
    none = type(actors)(frames=actors.frames, offsets=np.zeros_like(actors.offsets), rows=actors.rows[:0])
    return replace(session, scene=replace(session.scene, actors=none))


def with_column(session: Session) -> Session:
    columns = {**session.scene.columns, "note": np.zeros(len(session.trajectory))}
    return replace(session, scene=replace(session.scene, columns=columns))


def without_actions(session: Session, role: Role) -> Session:
    decisions = session.decisions or ()
    found = next(decision for decision in decisions if role in decision.actions)
    others = {each: action for each, action in found.actions.items() if each is not role}
    changed = [Decision(frame=found.frame, actions=others)] if others else []
    kept = [decision for decision in decisions if decision is not found]
    return replace(session, decisions=tuple(sorted([*kept, *changed], key=lambda decision: decision.frame)))


def no_end_line(folder: Path) -> None:
    for path in sessions_of(folder):
        file = path / "events.jsonl"
        file.write_text("".join(line for line in file.read_text().splitlines(keepends=True) if '"End"' not in line))
    measured_again(folder)


def no_end(folder: Path) -> None:
    for path in sessions_of(folder):
        resave(path, lambda session: with_event(session, len(session.events) - 1, None))


def declare_error(folder: Path, *, delete: bool) -> None:
    result = read_result(folder)
    rows = (replace(result.rows[0], record=None, error="ValueError: no"), *result.rows[1:])
    page = RolloutResult(settings=result.settings, rows=rows).to_json()
    (folder / "rollout.json").write_text(to_page(page))
    if delete:
        shutil.rmtree(sessions_of(folder)[0])


def drop_session(folder: Path) -> None:
    result = read_result(folder)
    (folder / "rollout.json").write_text(
        to_page(RolloutResult(settings=result.settings, rows=result.rows[1:]).to_json())
    )
    shutil.rmtree(sessions_of(folder)[0])


def repeat_session(folder: Path) -> None:
    """Puts a session into the place of another one, with the header of that one."""
    first, second = sessions_of(folder)[:2]
    wanted = Session.load(second).header
    shutil.rmtree(second)
    shutil.copytree(first, second)
    resave(second, lambda session: replace(session, header=wanted))


def swap_sessions(folder: Path) -> None:
    first, second = sessions_of(folder)[:2]
    kept = folder.parent / "kept"
    first.rename(kept)
    second.rename(first)
    kept.rename(second)
    measured_again(folder)


def reverse_rows(folder: Path) -> None:
    result = read_result(folder)
    page = RolloutResult(settings=result.settings, rows=result.rows[::-1]).to_json()
    (folder / "rollout.json").write_text(to_page(page))


def add_usage(folder: Path, role: Role = Role.CO_WIZARD) -> None:
    """Invents what a language model has cost."""
    usage = {str(role): ModelUsage(model="large", calls=1, answers=1)}
    (sessions_of(folder)[0] / "usage.json").write_text(to_page(usage_to_json(usage)))
    result = read_result(folder)
    rows = (replace(result.rows[0], usage=usage), *result.rows[1:])
    (folder / "rollout.json").write_text(to_page(RolloutResult(settings=result.settings, rows=rows).to_json()))
