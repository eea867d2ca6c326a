"""Playing a recorded session again from its seed and what the roles decided."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

from dorothie_gym.engine.config import EnvConfig, RewardWeights
from dorothie_gym.engine.recorder import SessionRecorder, expand, idle_actions
from dorothie_gym.engine.scenario import Scenario, draw_scenario
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.maps import Town
from dorothie_gym.recording import Session, SessionHeader, SessionWriter
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.spaces import ActionDict, Observation
from dorothie_gym.tasks import StoryboardTemplate, load_template, template_names

Observations: TypeAlias = Mapping[str, Observation]
"""What each role observes."""

Actions: TypeAlias = Mapping[str, ActionDict]
"""What each role does."""


def resimulate(session: Session, town: Town, *, storyboard: StoryboardTemplate | None = None) -> Session:
    """Plays a session again: the world from its seed, the roles as they decided then.

    Args:
        session: one that this package has recorded, whole or cut off; it is played as far as it was recorded.
        town: the town that it was played in.
        storyboard: its storyboard's template, where that is none of those that are shipped.

    Returns:
        What is recorded now; `first_difference` compares the two.

    Raises:
        SessionError: what the roles decided is not known, or the seed gives another session in this town, or an action
            cannot be taken.
    """
    env, observations = _begin(session, town, storyboard)
    with tempfile.TemporaryDirectory(prefix="dorothie_gym-") as folder:
        with SessionWriter(Path(folder) / "again", env.session_header()) as writer:
            recorder = SessionRecorder(env, writer)
            for _, actions in _play(env, session, observations):
                recorder.record(actions)
            if not env.agents:
                writer.finish(env.summary())
        return Session.load(Path(folder) / "again")


def watch_session(
    session: Session, town: Town, *, storyboard: StoryboardTemplate | None = None
) -> Iterator[tuple[Observations, Actions]]:
    """Plays a session again, and yields what the roles observed at each decision with what they did.

    Args:
        session: one that this package has recorded.
        town: the town that it was played in.
        storyboard: its storyboard's template, where that is none of those that are shipped.

    Raises:
        SessionError: see `resimulate`.
    """
    env, observations = _begin(session, town, storyboard)
    yield from _play(env, session, observations)


def _begin(
    session: Session, town: Town, storyboard: StoryboardTemplate | None
) -> tuple[DuoWizardEnv, Observations]:  # fmt: skip
    """The environment as the session began, and what was observed then."""
    if session.decisions is None:
        raise SessionError(f"{session.name}: what the roles decided was not recorded; it cannot be played again")
    if session.header.seed is None:
        raise SessionError(f"{session.name}: has no seed; it cannot be played again")
    config = _config(session.header)
    env = DuoWizardEnv(town, config=config, max_cycles=_cycles(session, config))
    observations, _ = env.reset(options={"scenario": _scenario(session, town, storyboard)})
    return env, observations


def _play(env: DuoWizardEnv, session: Session, observations: Observations) -> Iterator[tuple[Observations, Actions]]:
    """Yields, after each decision, what was observed before it and what was done."""
    decided = {decision.frame: decision for decision in session.decisions or ()}
    idle = idle_actions(env.limits)
    last = int(session.trajectory["frame"][-1]) if len(session.trajectory) else 0
    world = env.stage.world
    while env.agents and world.frame < last:
        decision = decided.get(world.frame)
        actions = idle if decision is None else expand(decision, env.limits)
        before = observations
        try:
            observations, *_ = env.step(actions)
        except ValueError as error:
            raise SessionError(f"{session.name}: decision at frame {world.frame}: {error}") from None
        yield before, actions


def _cycles(session: Session, config: EnvConfig) -> int | None:
    """After how many decisions the session was cut off, where its configuration does not tell."""
    summary = session.summary or {}
    if not session.complete or summary.get("reason") != "out of time" or not len(session.trajectory):
        return None
    return max(int(session.trajectory["frame"][-1]) // config.frames, 1)


def _scenario(session: Session, town: Town, storyboard: StoryboardTemplate | None) -> Scenario:
    """What the session began with, drawn again; with the storyboard drawn too, or given as it may have been."""
    header = session.header
    assert header.seed is not None
    templates: list[StoryboardTemplate | None] = [storyboard]
    if storyboard is None and header.storyboard in template_names():
        templates.append(load_template(header.storyboard))
    drawn = [draw_scenario(town, template, header.seed) for template in templates]
    for scenario in drawn:
        if _fits(scenario, header):
            return scenario
    if storyboard is None and header.storyboard not in template_names():
        raise SessionError(f"{session.name}: the storyboard {header.storyboard!r} is not shipped; give its file")
    return drawn[-1]  # its header differs, and the comparison tells where


def _fits(scenario: Scenario, header: SessionHeader) -> bool:
    board = scenario.storyboard
    return (
        board.name == header.storyboard
        and tuple(name.label for name in scenario.street_names) == tuple(header.street_names)
        and tuple(scenario.departure) == tuple(header.departure)
        and [(mark.lane, mark.station) for mark in board.landmarks]
        == [(row["lane"], row["station"]) for row in header.landmarks]
        and [goal.description for goal in board.subgoals] == [row["description"] for row in header.subgoals]
    )


def _config(header: SessionHeader) -> EnvConfig:
    """The environment's configuration that a header tells of."""
    values: dict[str, Any] = dict(header.config)
    try:
        world, rewards = values.pop("world", {}), values.pop("rewards", {})
        if not isinstance(world, Mapping) or not isinstance(rewards, Mapping):
            raise TypeError("world and rewards must be objects")
        return EnvConfig(**values, world=WorldConfig(**world), rewards=RewardWeights(**rewards))
    except (TypeError, ValueError) as error:
        raise SessionError(f"header: field 'config' is that of no environment of this version ({error})") from None
