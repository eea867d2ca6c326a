"""Environment of OpenEnv: one session by text for each connection."""

from __future__ import annotations

from secrets import randbits
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

from openenv.core.env_server.interfaces import Environment
from openenv.core.env_server.types import EnvironmentMetadata, State

from dorothie_gym.agents.openenv.models import TextAction, TextObservation
from dorothie_gym.agents.text_session import TextSession
from dorothie_gym.errors import AgentSessionError, short_repr
from dorothie_gym.maps.catalogue import find_town, town_names
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.maps.generated.specification import parse_series

if TYPE_CHECKING:
    from dorothie_gym.agents.turn import Turn


_PLAYING: Final = Lock()
"""Held by the session that plays: the interpreter runs one thread at a time, and turns that share it are all late."""


class DorothieEnvironment(Environment[TextAction, TextObservation, State]):
    """Session of one role by text.

    An agent's mistake comes back in the observation (`error`). A step before a reset is an exception: it is also what
    a client meets that has lost its connection and got another environment.
    """

    SUPPORTS_CONCURRENT_SESSIONS = True

    def __init__(self) -> None:
        super().__init__()
        self._session: TextSession | None = None
        self._settings: tuple[str, ...] = ()
        self._score = 0.0
        self._state = State(episode_id=None, step_count=0)

    def reset(
        self,
        seed: int | None = None,
        episode_id: str | None = None,
        role: str = "co_wizard",
        town: str = DEFAULT_TOWN,
        pages: str = "full",
        **unknown: Any,
    ) -> TextObservation:
        """Begins a session.

        Args:
            seed: seed of the session; None draws one, which is in the state.
            episode_id: name of the episode.
            role: role of the agent.
            town: name of a shipped or generated town; a client cannot name files of the server.
            pages: "full" or "changes".
            unknown: must be empty.

        Raises:
            ValueError: an argument is unknown or out of its range.
        """
        if unknown:
            raise ValueError(f"reset has no argument {', '.join(unknown)}; it has seed, episode_id, role, town, pages")
        if self._session is None or self._settings != (role, town, pages):
            _check_town(town)
            self._session, self._settings = TextSession(role, town, pages=pages), (role, town, pages)
        drawn = randbits(31) if seed is None else seed
        state = State(episode_id=episode_id, step_count=0, seed=drawn, role=role, town=town)
        with _PLAYING:
            turn = self._session.reset(drawn)
        self._score, self._state = 0.0, state
        return self._observation(self._session, turn)

    def step(self, action: TextAction, timeout_s: float | None = None, **_: Any) -> TextObservation:
        """Takes an answer, or a call of a tool; raises `AgentSessionError` before a reset."""
        session = self._session
        if session is None:
            raise AgentSessionError("no session has begun here: call reset() first, also after a lost connection")
        self._state.step_count += 1
        with _PLAYING:
            turn = _played(session, action)
        return self._observation(session, turn)

    @property
    def state(self) -> State:
        """Seed, role and town of the session, and the number of steps."""
        return self._state

    def get_metadata(self) -> EnvironmentMetadata:
        """Returns name and description."""
        return EnvironmentMetadata(name="dorothie", description="Situated dialogue between a passenger and a driver")

    def _observation(self, session: TextSession, turn: Turn) -> TextObservation:
        before, self._score = self._score, session.score
        return TextObservation(
            page=turn.page,
            system=turn.system if self._state.step_count == 0 else "",
            done=turn.done,
            reward=round(self._score - before, 6),
            time=turn.time,
            truncated=turn.truncated,
            error=turn.error,
            choices={name: list(labels) for name, labels in turn.choices.items()},
            outcome=session.finish().numbers() if turn.done else {},
        )


def _played(session: TextSession, action: TextAction) -> Turn:
    if action.tool == "answer":
        return session.answer(action.value)
    argument = next((tool.argument for tool in session.tools() if tool.name == action.tool), "")
    return session.tool(action.tool, **({argument or "value": action.value} if action.value else {}))


def _check_town(name: object) -> None:
    """Raises `ValueError` unless a name is that of a shipped or generated town, or of a series of these."""
    if not isinstance(name, str) or not (parse_series(name) or find_town(name, None)):
        raise ValueError(f"town is {short_repr(name)}; the towns are {', '.join(town_names())} and generated:SEED")
