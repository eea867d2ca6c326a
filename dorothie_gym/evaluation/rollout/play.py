"""Playing of one session by policies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

from dorothie_gym.evaluation.rollout.folder import noticing_deletion
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.policy import AnyPolicy, Players, policy_seed
from dorothie_gym.session.recorder import SessionRecorder
from dorothie_gym.session.recording.files import to_page
from dorothie_gym.session.recording.writer import SessionWriter
from dorothie_gym.session.spaces.actions import encoded
from dorothie_gym.support.files import write_atomically

if TYPE_CHECKING:
    from dorothie_gym.session.recording.header import SessionHeader
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.session_engine import SessionEngine
    from dorothie_gym.session.session_log import SessionSummary
    from dorothie_gym.session.spaces.actions import ActionMapping

PERSONAS: Final = "personas"
"""Field of a header with the personas of the scripted speakers, by role; see `dorothie_gym.policies.persona`."""

PITCH: Final = "pitch"
"""Trait that is the pitch of a persona's voice."""

USAGE_FILE: Final = "usage.json"
"""Cost of the policies in a session (calls, tokens), by role; not part of the recording, and absent if there is none.
"""


class SessionHost(Protocol):
    """Object that plays sessions with an engine inside: a `SessionEngine` itself, or a `DuoWizardEnv`."""

    @property
    def engine(self) -> SessionEngine:
        """Engine of the sessions."""
        ...

    def reset(self, seed: int | None = None) -> object:
        """Begins a session."""

    def step(self, actions: Mapping[str, ActionMapping]) -> object:
        """Plays one decision with an action for each agent."""


def play_session(
    host: SessionHost,
    policies: Mapping[Role, AnyPolicy],
    *,
    seed: int,
    folder: Path | str | None = None,
    create: bool = True,
    on_step: Callable[[SessionEngine], None] | None = None,
    scenario: Scenario | None = None,
    trial: int = 0,
) -> SessionSummary:
    """Plays a session from reset to end.

    Args:
        host: a `SessionEngine` or a `DuoWizardEnv`; it is reset.
        policies: one for each of the three roles.
        seed: seed of the session; session and policies follow from it.
        folder: folder in which the session is recorded decision by decision; None records nothing. An interrupted
            session stays in its folder and can be loaded.
        create: whether the folder is created if it is missing.
        on_step: called with the engine after the reset and after each decision.
        scenario: scenario that the engine plays in place of the drawn one.
        trial: number of the trial, of several of one scenario, in which the policies have other seeds.

    Returns:
        The summary of the session; with `usage`, by role, if a policy has any (`Policy.usage_of`).

    Raises:
        ValueError: a role has no policy.
        SessionError: the folder holds a session already.
        OutputFolderError: the folder was deleted during the session.
        OSError: the folder cannot be written.
    """
    missing = [role for role in AGENT_ROLES if role not in policies]
    if missing:
        raise ValueError(f"policies has none for {', '.join(missing)}; each of the three roles needs one")
    engine = host.engine
    if scenario is None:
        host.reset(seed=seed)
    else:
        engine.reset(scenario=scenario)
    players = Players({role: policies[role] for role in AGENT_ROLES})
    states = {role: policies[role].initial_state(policy_seed(seed, role, trial), engine.town) for role in AGENT_ROLES}
    engine.session.dialogue.give_voices(pitches_of(personas_of(policies, states)))
    with ExitStack() as stack:
        writer = None
        if folder is not None:
            header = with_personas(engine.session_header(), policies, states)
            writer = stack.enter_context(SessionWriter(folder, header, create=create))
            stack.enter_context(noticing_deletion(writer.folder))
        recorder = None if writer is None else SessionRecorder(engine, writer)
        if on_step is not None:
            on_step(engine)
        while not engine.over:
            actions = players.decide(engine, states)
            if host is engine:
                engine.step(actions)
            else:
                host.step({agent: encoded(action, engine.limits) for agent, action in actions.items()})
            if recorder is not None:
                recorder.record(actions)
            if on_step is not None:
                on_step(engine)
        usage = usage_of(policies, states)
        if writer is not None:
            if usage:
                write_atomically(writer.folder / USAGE_FILE, to_page(usage))
            writer.finish(engine.summary())
    summary = engine.summary()
    return {**summary, "usage": usage} if usage else summary


def usage_of(policies: Mapping[Role, AnyPolicy], states: Mapping[Role, Any]) -> dict[str, Mapping[str, object]]:
    """Returns the costs of the policies of a session, by role; empty if there are none."""
    found = {str(role): policy.usage_of(states[role]) for role, policy in policies.items()}
    return {role: usage for role, usage in found.items() if usage is not None}


def with_personas(
    header: SessionHeader, policies: Mapping[Role, AnyPolicy], states: Mapping[Role, object]
) -> SessionHeader:
    """Returns a header that records the personas of policies, by role; the same one if there are none."""
    personas = personas_of(policies, states)
    return replace(header, extra={**header.extra, PERSONAS: personas}) if personas else header


def personas_of(
    policies: Mapping[Role, AnyPolicy], states: Mapping[Role, object]
) -> dict[str, Mapping[str, float | str]]:
    """Returns the personas of policies, by role; those that have none are left out."""
    found = {str(role): policy.persona_of(states[role]) for role, policy in policies.items()}
    return {role: persona for role, persona in found.items() if persona is not None}


def pitches_of(personas: object) -> dict[Role, float]:
    """Returns the pitch of the speakers' voices by role, from the personas in a header; empty without personas."""
    known = personas if isinstance(personas, Mapping) else {}
    found = {role: known[str(role)].get(PITCH) for role in AGENT_ROLES if isinstance(known.get(str(role)), Mapping)}
    return {role: float(pitch) for role, pitch in found.items() if isinstance(pitch, float | int)}
