"""Environment of OpenEnv: one session by text for each connection."""

from __future__ import annotations

from secrets import randbits
from typing import TYPE_CHECKING, Any

from openenv.core.env_server.interfaces import Environment
from openenv.core.env_server.types import EnvironmentMetadata, State

from dorothie_gym.agents.openenv.models import TextAction, TextObservation
from dorothie_gym.agents.text_session import TextSession
from dorothie_gym.errors import AgentSessionError
from dorothie_gym.maps.folds import DEFAULT_TOWN

if TYPE_CHECKING:
    from dorothie_gym.agents.turn import Turn


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
            town: name of a town.
            pages: "full" or "changes".
            unknown: must be empty.

        Raises:
            ValueError: an argument is unknown or out of its range.
        """
        if unknown:
            raise ValueError(f"reset has no argument {', '.join(unknown)}; it has seed, episode_id, role, town, pages")
        if self._session is None or self._settings != (role, town, pages):
            self._session, self._settings = TextSession(role, town, pages=pages), (role, town, pages)
        drawn = randbits(31) if seed is None else seed
        turn = self._session.reset(drawn)
        self._score = 0.0
        self._state = State(episode_id=episode_id, step_count=0, seed=drawn, role=role, town=town)
        return self._observation(self._session, turn)

    def step(self, action: TextAction, timeout_s: float | None = None, **_: Any) -> TextObservation:
        """Takes an answer, or a call of a tool; raises `AgentSessionError` before a reset."""
        session = self._session
        if session is None:
            raise AgentSessionError("no session has begun here: call reset() first, also after a lost connection")
        self._state.step_count += 1
        if action.tool == "answer":
            return self._observation(session, session.answer(action.value))
        argument = next((tool.argument for tool in session.tools() if tool.name == action.tool), "value")
        return self._observation(
            session, session.tool(action.tool, **({argument or "value": action.value} if action.value else {}))
        )

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
            page=turn.page, system=turn.system if self._state.step_count == 0 else "", done=turn.done,
            reward=round(self._score - before, 6), time=turn.time, truncated=turn.truncated, error=turn.error,
            choices={name: list(labels) for name, labels in turn.choices.items()},
            outcome=session.finish().numbers() if turn.done else {},
        )  # fmt: skip
