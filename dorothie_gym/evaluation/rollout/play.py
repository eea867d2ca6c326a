"""Playing of sessions by policies: one, or several at the same time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

from dorothie_gym.evaluation.rollout.folder import noticing_deletion
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.batch_players import BatchPlayers
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.policy import AnyPolicy, Players
from dorothie_gym.session.recorder import SessionRecorder
from dorothie_gym.session.recording.files import to_page
from dorothie_gym.session.recording.writer import SessionWriter
from dorothie_gym.session.scenario import Scenario
from dorothie_gym.session.spaces.actions import encoded
from dorothie_gym.support.files import write_atomically

if TYPE_CHECKING:
    from dorothie_gym.session.recording.header import SessionHeader
    from dorothie_gym.session.session_engine import SessionEngine
    from dorothie_gym.session.session_log import SessionSummary
    from dorothie_gym.session.spaces.actions import ActionMapping, AnyAction

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
    extra: Mapping[str, object] | None = None,
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
        extra: further fields of `SessionHeader.extra`.

    Returns:
        The summary of the session; with `usage`, by role, if a policy has any (`Policy.usage_of`).

    Raises:
        ValueError: a role has no policy.
        SessionError: the folder holds a session already.
        OutputFolderError: the folder was deleted during the session.
        OSError: the folder cannot be written.
    """
    cast = SessionCast(
        host=host,
        policies=policies,
        seed=seed,
        folder=folder,
        create=create,
        scenario=scenario,
        trial=trial,
        extra=extra or {},
    )
    return _play_alone(cast, on_step)


def play_together(casts: Sequence[SessionCast]) -> list[SessionSummary]:
    """Plays several sessions at the same time; each is the one that `play_session` plays, to the bit.

    Where several sessions share a `BatchPolicy`, it decides once for all of them.

    Args:
        casts: the sessions, each with a host of its own.

    Returns:
        The summary of each session, as of `play_session`.

    Raises:
        ValueError: a role has no policy.
        SessionError: a folder holds a session already.
        OutputFolderError: a folder was deleted during the session.
        OSError: a folder cannot be written.
    """
    summaries = dict(play_as_they_end(casts))
    return [summaries[number] for number in range(len(casts))]


def play_as_they_end(casts: Sequence[SessionCast]) -> Iterator[tuple[int, SessionSummary]]:
    """Plays several sessions at the same time, as `play_together`, and yields each when it ends.

    Args:
        casts: the sessions, each with a host of its own.

    Yields:
        Index of a session in `casts`, and its summary; its files are complete.

    Raises:
        ValueError: a role has no policy.
        SessionError: a folder holds a session already.
        OutputFolderError: a folder was deleted during the session.
        OSError: a folder cannot be written.
    """
    if len(casts) == 1:
        yield 0, _play_alone(casts[0])
        return
    with ExitStack() as stack:
        files = [stack.enter_context(ExitStack()) for _ in casts]
        plays = [own.enter_context(_Play.begin(cast)) for own, cast in zip(files, casts, strict=True)]
        players = BatchPlayers([play.policies for play in plays])
        playing = {number: (play.engine, play.states) for number, play in enumerate(plays)}
        while playing:
            for number, actions in players.decide(playing).items():
                plays[number].step(actions)
                if plays[number].engine.over:
                    summary = plays[number].finish()
                    files[number].close()
                    del playing[number]
                    yield number, summary


def _play_alone(cast: SessionCast, on_step: Callable[[SessionEngine], None] | None = None) -> SessionSummary:
    """Plays one session, see `play_session`."""
    with _Play.begin(cast) as play:
        if on_step is not None:
            on_step(play.engine)
        players = Players(play.policies)
        while not play.engine.over:
            play.step(players.decide(play.engine, play.states))
            if on_step is not None:
                on_step(play.engine)
        return play.finish()


@dataclass(frozen=True, kw_only=True)
class SessionCast:
    """Session to be played, and the policies that play it; see `play_session` for the fields."""

    host: SessionHost
    policies: Mapping[Role, AnyPolicy]
    seed: int
    folder: Path | str | None = None
    create: bool = True
    scenario: Scenario | None = None
    trial: int = 0
    extra: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class _Play:
    """Session in progress, with the states of its policies and its recorder."""

    host: SessionHost
    policies: Mapping[Role, AnyPolicy]
    states: dict[Role, Any]
    writer: SessionWriter | None
    recorder: SessionRecorder | None

    @classmethod
    @contextmanager
    def begin(cls, cast: SessionCast) -> Iterator[_Play]:
        """Begins a session; the end of the block closes its files."""
        missing = [role for role in AGENT_ROLES if role not in cast.policies]
        if missing:
            raise ValueError(f"policies has none for {', '.join(missing)}; each of the three roles needs one")
        engine = cast.host.engine
        if cast.scenario is None:
            cast.host.reset(seed=cast.seed)
        else:
            engine.reset(scenario=cast.scenario)
        policies = {role: cast.policies[role] for role in AGENT_ROLES}
        states = {
            role: policy.initial_state(policy_seed(cast.seed, role, cast.trial), engine.town)
            for role, policy in policies.items()
        }
        engine.session.dialogue.give_voices(pitches_of(personas_of(policies, states)))
        if cast.folder is None:
            yield cls(host=cast.host, policies=policies, states=states, writer=None, recorder=None)
            return
        header = with_personas(with_extra(engine.session_header(), cast.extra), policies, states)
        with SessionWriter(cast.folder, header, create=cast.create) as writer, noticing_deletion(writer.folder):
            recorder = SessionRecorder(engine, writer)
            yield cls(host=cast.host, policies=policies, states=states, writer=writer, recorder=recorder)

    @property
    def engine(self) -> SessionEngine:
        """Engine of the session."""
        return self.host.engine

    def step(self, actions: Mapping[str, AnyAction]) -> None:
        """Plays and records one decision."""
        if self.host is self.engine:
            self.engine.step(actions)
        else:
            self.host.step({agent: encoded(action, self.engine.limits) for agent, action in actions.items()})
        if self.recorder is not None:
            self.recorder.record(actions)

    def finish(self) -> SessionSummary:
        """Finishes the record; returns the summary, with the costs of the policies if there are any."""
        usage, summary = usage_of(self.policies, self.states), self.engine.summary()
        if self.writer is not None:
            if usage:
                write_atomically(self.writer.folder / USAGE_FILE, to_page(usage))
            self.writer.finish(summary)
        return {**summary, "usage": usage} if usage else summary


def usage_of(policies: Mapping[Role, AnyPolicy], states: Mapping[Role, Any]) -> dict[str, Mapping[str, object]]:
    """Returns the costs of the policies of a session, by role; empty if there are none."""
    found = {str(role): policy.usage_of(states[role]) for role, policy in policies.items()}
    return {role: usage for role, usage in found.items() if usage is not None}


def with_extra(header: SessionHeader, extra: Mapping[str, object]) -> SessionHeader:
    """Returns a header with further fields in `extra`; the same one if there are none."""
    return replace(header, extra={**header.extra, **extra}) if extra else header


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
