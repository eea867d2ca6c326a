"""Session in which an agent plays one role by text, and policies play the others.

The session stops wherever `LanguageModelPolicy` would call its model, hands the page out (`Turn`), and goes on with the
answer, so that equal answers give equal sessions.
"""

from __future__ import annotations

import enum
import json
import operator
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NoReturn

from dorothie_gym.agents.page_changes import page_changes
from dorothie_gym.agents.score import TaskProgress, score_of, score_of_talk
from dorothie_gym.agents.talk_tasks import TalkReferee
from dorothie_gym.agents.tools import LOOK, TOOLS, WAIT, ToolSpec, waiting_label
from dorothie_gym.agents.turn import Outcome, Turn
from dorothie_gym.errors import AgentSessionError, short_repr
from dorothie_gym.evaluation.rollout.play import personas_of, pitches_of, usage_of
from dorothie_gym.evaluation.tier_settings import tier_settings
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.casting import partners_of
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.language_model.answer_schema import MAX_ANSWER, AnswerSchema, ChoiceField
from dorothie_gym.policies.language_model.config import QUIET_TIME
from dorothie_gym.policies.language_model.faults import CallError, Fault
from dorothie_gym.policies.language_model.picture import picture_address
from dorothie_gym.policies.language_model.role_interface import KEEP
from dorothie_gym.policies.language_model.turns import RoleTurns
from dorothie_gym.policies.policy import Players, replace
from dorothie_gym.session.scenario import Scenario
from dorothie_gym.session.session_engine import SessionEngine

if TYPE_CHECKING:
    from pathlib import Path

    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.policy import AnyPolicy
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.session.spaces.observations import ObservationMapping

_AGAIN: Final = "again"
_NOTE: Final = "note"
UNFINISHED: Final = "unfinished"
"""Reason of the outcome of a session that was not over."""


class PageStyle(enum.StrEnum):
    """Pages that a session hands out."""

    FULL = "full"
    """The whole page at each turn, for agents that see the last page only."""
    CHANGES = "changes"
    """The whole page first, and then what has changed, for agents that see all pages so far."""


class TextSession:
    """Session of one role by text: `reset`, then `answer` or `tool` until the turn is `done`, then `finish`.

    A mistake of the agent is never an exception: it costs a turn, no simulated time, and comes back as words
    (`Turn.error`). Mistakes of the program around it (an answer before `reset`, a wrong role) are exceptions.

    Args:
        role: role of the agent: "co_wizard", "participant" or "ad_wizard".
        town: name of a town, path of a map, or a `Town`; by default that of the tier, or `DEFAULT_TOWN`.
        config: settings of the sessions, also as a mapping.
        partners: policy of other roles, or its name, by role; "scripted" for those that are not named.
        tier: name of a `Tier`, which gives town, settings and partners that are not given themselves.
        pages: whole pages, or changes.
        max_turns: number of answers and tool calls after which the session is truncated.
        max_faults: number of refused answers and tool calls after which the session is truncated.
        quiet_time: longest time between two turns [s]; an answer may request a shorter one.

    Raises:
        ValueError: an argument is out of its range, or there is no such role, policy or tier.
    """

    def __init__(
        self,
        role: Role | str = Role.CO_WIZARD,
        town: str | Path | Town | None = None,
        *,
        config: EnvConfig | Mapping[str, object] | None = None,
        partners: Mapping[str, str | AnyPolicy] | None = None,
        tier: str | None = None,
        pages: PageStyle | str = PageStyle.FULL,
        max_turns: int = 400,
        max_faults: int = 20,
        quiet_time: float = QUIET_TIME,
    ) -> None:
        if role not in AGENT_ROLES:
            raise ValueError(f"role is {short_repr(role)}; it must be one of {', '.join(AGENT_ROLES)}")
        if pages not in list(PageStyle):
            raise ValueError(f"pages is {short_repr(pages)}; it must be one of {', '.join(PageStyle)}")
        for name, limit in (("max_turns", max_turns), ("max_faults", max_faults)):
            if not isinstance(limit, int) or limit < 1:
                raise ValueError(f"{name} is {short_repr(limit)}; it must be a whole number of at least 1")
        self.role, self.pages = Role(role), PageStyle(pages)
        self.max_turns, self.max_faults = max_turns, max_faults
        usual = tier_settings(tier, self.role)
        self.engine = SessionEngine(
            usual.town if town is None else town, config=usual.config if config is None else config
        )
        self._turns = RoleTurns(self.role, self.engine.limits, quiet_time)
        self._partners = partners_of(self.role, {**usual.partners, **(partners or {})}, self.engine.limits)
        self._players = Players(self._partners)
        self._progress: TaskProgress | None = None

    @property
    def system(self) -> str:
        """The role, and the fields of an answer and their meanings."""
        return self._turns.system

    @property
    def schema(self) -> dict[str, Any]:
        """JSON schema of the answers, the same in all turns of the role; `Turn.schema` lists the choices of a turn.

        Raises:
            AgentSessionError: `reset` was not called.
        """
        self._begun()
        return self._schema.json_schema(shared=True)

    def tools(self) -> tuple[ToolSpec, ...]:
        """Returns the tools of the role, the same in all sessions."""
        return TOOLS[self.role]

    def reset(self, seed: int = 0, scenario: Scenario | None = None) -> Turn:
        """Begins a session, and returns its first turn.

        Args:
            seed: seed of the session, at least 0: equal seeds and answers give equal sessions.
            scenario: played in place of the one of the seed; its seed is then the session's.

        Raises:
            ValueError: the seed is no whole number of at least 0, or the scenario is none.
        """
        if scenario is not None and not isinstance(scenario, Scenario):
            raise ValueError(f"scenario is a {type(scenario).__name__}; it must be a Scenario")
        engine = self.engine
        engine.reset(_checked_seed(seed), scenario=scenario)
        drawn = engine.scenario.seed
        self._states = {
            role: policy.initial_state(policy_seed(drawn, role), engine.town) for role, policy in self._partners.items()
        }
        engine.session.dialogue.give_voices(pitches_of(personas_of(self._partners, self._states)))
        self._state = self._turns.begin(engine.town)
        self._progress = TaskProgress(engine.session)
        self._referee = None if engine.config.talk is None else TalkReferee(engine)
        self._draft: dict[str, Any] = {}
        self._page, self._truncated = "", False
        self._reward, self._gained, self._count, self._faults = 0.0, 0.0, 0, 0
        self._characters = len(self.system)
        return self._until_asked()

    # --- One answer a turn --------------------------------------------------------------------------------------------

    def answer(self, given: str | Mapping[str, object]) -> Turn:
        """Takes an answer, and lets time pass until the next turn.

        Args:
            given: JSON object of the schema, as text or as a mapping. Fields that are left out have their defaults.

        Raises:
            AgentSessionError: `reset` was not called.
        """
        if self._ended():
            return self._shown(_OVER, error=_OVER)
        self._count += 1
        try:
            read = self._schema.read(_as_text(given))
        except CallError as error:
            return self._fault(error.reason)
        return self._go_on(read)

    # --- Tools --------------------------------------------------------------------------------------------------------

    def tool(self, name: str, /, **arguments: object) -> Turn:
        """Calls a tool: fields of the answer are collected until `wait`, which lets time pass.

        Args:
            name: name of the tool.
            arguments: arguments of the tool.

        Raises:
            AgentSessionError: `reset` was not called.
        """
        if self._ended():
            return self._shown(_OVER, error=_OVER)
        self._count += 1
        spec = next((each for each in self.tools() if each.name == name), None)
        if spec is None:
            known = ", ".join(each.name for each in self.tools())
            return self._fault(f"there is no tool {short_repr(name)}; the tools are {known}")
        try:
            value = spec.value_of(arguments)
            if spec.name == LOOK:
                return self._turn(self._page)
            if spec.name == WAIT:
                return self._go_on(self._drafted(value))
            self._schema.read(_as_text({spec.field: value}))
        except ValueError as error:
            return self._fault(str(error))
        except CallError as error:
            return self._fault(error.reason)
        self._draft[spec.field] = value
        return self._turn(f"Noted: {spec.name} {short_repr(value)}. Call {WAIT} to let it happen.")

    def _drafted(self, seconds: object) -> dict[str, str]:
        """Returns the answer that the tools have filled, with the time to wait."""
        again = next(field for field in self._schema.fields if field.name == _AGAIN)
        labels = again.labels if isinstance(again, ChoiceField) else ()
        return self._schema.read(json.dumps({_NOTE: KEEP, **self._draft, _AGAIN: waiting_label(seconds, labels)}))

    # --- The end ------------------------------------------------------------------------------------------------------

    @property
    def score(self) -> float:
        """Score so far, in [0, 1]; raises `AgentSessionError` before the first reset."""
        return self._judged()[0]

    def _judged(self) -> tuple[float, bool, str]:
        """Returns the score, the success, and what has decided a talk task."""
        progress, session = self._begun(), self.engine.session
        verdict = None if self._referee is None else self._referee.verdict()
        if verdict is None:
            return score_of(session, progress, self.role), session.success, ""
        return score_of_talk(session, self.role, passed=verdict.passed), verdict.passed, verdict.cause

    def finish(self) -> Outcome:
        """Ends the session, over or not, and returns its outcome; later answers have no effect.

        Raises:
            AgentSessionError: `reset` was not called.
        """
        self._begun()
        self._truncated = self._truncated or not self.engine.over
        summary, usage = self.engine.summary(), usage_of(self._partners, self._states)
        score, success, cause = self._judged()
        return Outcome(
            score=score,
            success=success,
            cause=cause,
            reached=summary["subgoals"]["reached"],
            live=summary["subgoals"]["live"],
            seconds=summary["seconds"],
            reason=summary.get("reason", UNFINISHED),
            reward=round(self._reward, 6),
            collisions=summary["collisions"],
            infractions=sum(summary["infractions"].values()),
            turns=self._count,
            faults=self._faults,
            expired=self._state.expired,
            characters=self._characters,
            usage=usage,
        )

    # --- Turns --------------------------------------------------------------------------------------------------------

    def _begun(self) -> TaskProgress:
        if self._progress is None:
            _refuse_unbegun()
        return self._progress

    def _ended(self) -> bool:
        """Whether the session is over; raises `AgentSessionError` before the first reset."""
        self._begun()
        return self._truncated or self.engine.over

    def _go_on(self, answer: Mapping[str, str]) -> Turn:
        """Lets an answer take effect, and returns the next turn."""
        self._state = self._turns.answered(self._observation, self._state, answer)
        self._draft = {}
        self._step()
        if self._count >= self.max_turns and not self.engine.over:
            return self._turn(f"The session ends after {self._count} turns.")
        return self._until_asked()

    def _until_asked(self) -> Turn:
        """Plays until an answer is requested, and returns the turn."""
        engine = self.engine
        while not engine.over:
            own, info = engine.observations.of([self.role])[str(self.role)], engine.info(self.role)
            further = {name: info[name] for name in ("action_mask", "refusal_reason")}
            self._observation: ObservationMapping = {**own, **further}
            self._state = self._turns.attend(self._observation, self._state)
            if self._turns.is_due(self._observation, self._state):
                page, self._schema = self._turns.page(self._observation, self._state)
                shows = page_changes(self._page, page) if self._page and self.pages is PageStyle.CHANGES else page
                self._page = page
                return self._turn(shows)
            self._step()
        return self._turn("The session is over.")

    def _step(self) -> None:
        """Plays one decision of all roles."""
        engine = self.engine
        action, self._state = self._turns.act(self._observation, self._state)
        outcome = engine.step({**self._players.decide(engine, self._states), str(self.role): action})
        self._gained += sum(outcome.reward_terms[self.role].values())
        self._begun().note()
        if self._referee is not None:
            self._referee.note()

    def _fault(self, reason: str) -> Turn:
        self._faults += 1
        return self._turn(f"Refused: {reason}", error=reason)

    def _turn(self, page: str, error: str = "") -> Turn:
        """Returns the next turn, which is the last one where a limit is reached."""
        self._characters += len(page)
        if self._count >= self.max_turns or self._faults >= self.max_faults:
            self._truncated = not self.engine.over
        return self._shown(page, error)

    def _shown(self, page: str, error: str) -> Turn:
        gained, self._gained = self._gained, 0.0
        self._reward += gained
        turn = Turn(
            page=page,
            system=self.system,
            reward=gained,
            time=self.engine.session.world.time,
            done=self._ended(),
            truncated=self._truncated,
            error=error,
        )
        if turn.done:
            return turn
        picture = picture_address(self._observation)
        return replace(turn, choices=_choices(self._schema), schema=self._schema.json_schema(), picture=picture)


_OVER: Final = "the session is over; nothing happens any more"


def _refuse_unbegun() -> NoReturn:
    raise AgentSessionError("no session has begun: call reset() first")


def _choices(schema: AnswerSchema) -> dict[str, tuple[str, ...]]:
    return {field.name: field.labels for field in schema.fields if isinstance(field, ChoiceField)}


def _as_text(given: object) -> str:
    """Returns an answer as text; raises `CallError` if it is no answer at all."""
    text = given
    if isinstance(given, Mapping):
        try:
            text = json.dumps(dict(given))
        except (TypeError, ValueError, RecursionError) as error:
            raise CallError(Fault.NOT_JSON, f"the answer is no JSON object ({error})") from None
    if not isinstance(text, str):
        raise CallError(Fault.NOT_JSON, f"the answer is a {type(given).__name__}; it must be a JSON object")
    if len(text) > MAX_ANSWER:
        raise CallError(
            Fault.CUT_OFF, f"the answer has {len(text)} characters; it must have at most {MAX_ANSWER} characters"
        )
    return text


def _checked_seed(seed: object) -> int:
    try:
        number = operator.index(seed)  # type: ignore[arg-type]
    except TypeError:
        number = -1
    if number < 0 or isinstance(seed, bool):
        raise ValueError(f"seed is {short_repr(seed)}; it must be a whole number of at least 0")
    return number
