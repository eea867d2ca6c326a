"""The scripted participant as a teacher: run alongside a session, it reports its choices and remarks.

The teacher has the player's observations. The player's remarks are copied into its state instead of its own (`settle`),
so that it continues from the player's situation, not from its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.baselines.roles.learned_role.dagger_sessions import new_remarks
from dorothie_gym.baselines.roles.participant.memory import KEEP_TARGET, SessionMemory, TargetChoice
from dorothie_gym.policies.participant.policy import ScriptedParticipant
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark
from dorothie_gym.session.spaces.actions import ActionDict

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.participant.config import ParticipantStyle
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping


@dataclass(frozen=True, kw_only=True)
class Lesson:
    """Decision of the teacher.

    Attributes:
        target: number of the subgoal that is its target; None if there is none.
        guiding: whether it guides the car.
        remarks: remarks that it chooses now, for this utterance or the next.
        action: its action.
    """

    target: int | None
    guiding: bool
    remarks: tuple[Remark, ...]
    action: ActionDict

    def choice(self, memory: SessionMemory) -> TargetChoice:
        """Returns the choice that sets the target of a memory to that of the teacher."""
        same = self.target is None or self.target == memory.records.task.target
        return TargetChoice(target=KEEP_TARGET if same or self.target is None else self.target, guiding=self.guiding)


class Teacher:
    """Scripted participant that runs alongside a session."""

    def __init__(self, town: Town, limits: SpaceLimits, seed: int, style: ParticipantStyle | None = None) -> None:
        """Prepares the teacher.

        Args:
            town: the map.
            limits: sizes of the spaces.
            seed: seed of its draws, that of the recorded policy where a recorded session is followed.
            style: style; None for the persona of the seed.
        """
        self._policy = ScriptedParticipant(limits, style)
        self.state: ParticipantState = self._policy.initial_state(seed, town)
        self._former = self.state

    def decide(self, observation: ObservationMapping) -> Lesson:
        """Takes a decision."""
        self._former = former = self.state
        action, state = self._policy.step(observation, former)
        self.state = state
        spoke = state.speech.last is not former.speech.last
        after = (*state.speech.said[-1:], *state.speech.queue) if spoke else state.speech.queue
        return Lesson(
            target=state.task.target,
            guiding=state.guidance.guiding,
            remarks=new_remarks(former.speech.queue, after),
            action=action,
        )

    def settle(self, memory: SessionMemory, *, spoke: bool) -> None:
        """Copies the player's choices and remarks into the state.

        Args:
            memory: the player's memory after the decision.
            spoke: whether the player has decided to make a remark.
        """
        records, state, former = memory.records, replace(self.state), self._former
        state.speech = records.speech
        if not spoke:
            heard_at = max(former.conversation.heard_at, state.conversation.heard_at)
            state.conversation = former.conversation.after_hearing(heard_at)
        if records.task.target == state.task.target:
            state.task, state.route = records.task, records.route
            state.guidance = records.guidance.with_guiding(state.guidance.guiding)
        self.state = state
