"""Partners of talk tasks: the client, who requests and replies by its brief, and the Ad-Wizard that closes streets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.refusals import asks, declines, named_places, named_streets, says
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind, PropKind
from dorothie_gym.policies.observation_parser import scalar
from dorothie_gym.policies.policy import TypedPolicy, replace
from dorothie_gym.session.spaces.actions import AdWizardAction, LanePosition, ParticipantAction, Speech
from dorothie_gym.session.spaces.observations import PropColumn
from dorothie_gym.session.talk_tasks import closure_in
from dorothie_gym.tasks.briefs import Brief, Cue, Reply, read_brief

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping

FIRST_WORDS: Final = 3.0
"""Time at which a client says its request [s]; a closed street is then in sight."""

MOST_REPLIES: Final = 8
"""Number of replies after which a client falls silent."""


@dataclass(frozen=True, kw_only=True)
class ClientState:
    """Memory of a client.

    Attributes:
        requested: whether it has said its request.
        used: number of replies of the brief that it has given.
        said: number of replies of any kind.
        waiting: what it says as soon as nobody speaks.
    """

    requested: bool = False
    used: int = 0
    said: int = 0
    waiting: str = ""


class Client(TypedPolicy[ClientState]):
    """Participant that acts by the brief in its story; it is silent in sessions of other storyboards."""

    def __init__(self, limits: SpaceLimits | None = None) -> None:
        """Prepares the policy; the sizes of the spaces default to those of `SpaceLimits`."""
        super().__init__(Role.PARTICIPANT, limits)

    def initial_state(self, seed: int, town: Town) -> ClientState:
        """Returns the state before the first decision."""
        return ClientState()

    def act(self, observation: ObservationMapping, state: ClientState) -> tuple[ParticipantAction, ClientState]:
        """Says the request, or a reply to what was heard."""
        brief = read_brief(str(observation["story"]))
        if brief is None:
            return ParticipantAction(), state
        if heard := str(observation["co_wizard_text"]):
            state = _heard(brief, heard, state)
        if not state.requested and scalar(observation, "time") >= FIRST_WORDS:
            state = replace(state, requested=True, waiting=brief.request)
        if not state.waiting or scalar(observation, "other_speaking"):
            return ParticipantAction(), state
        move = DialogueMove.REPLY_W
        if state.waiting == brief.request:
            move = DialogueMove.QUERY_W if asks(brief.request) else DialogueMove.INSTRUCT
        act = DialogueAct.of(move, *named_places(state.waiting), *named_streets(state.waiting))
        return ParticipantAction(speech=Speech(act=act, text=state.waiting)), replace(state, waiting="")


def _heard(brief: Brief, heard: str, state: ClientState) -> ClientState:
    """Chooses the reply to an utterance, if any."""
    if not state.requested or state.said >= MOST_REPLIES:
        return state
    text, used = "", state.used
    if used < len(brief.replies) and fits(brief.replies[used], heard):
        text, used = brief.replies[used].text, used + 1
    elif declines(heard):
        text = brief.declined if used == len(brief.replies) else brief.otherwise
    elif asks(heard):
        text = brief.settling if brief.replies and used == len(brief.replies) else brief.otherwise
    return replace(state, used=used, said=state.said + bool(text), waiting=text)


def fits(reply: Reply, heard: str) -> bool:
    """Returns whether a reply answers an utterance."""
    return any(says(heard, word) for word in reply.words) and (reply.cue is Cue.TOLD or asks(heard))


MOST_ATTEMPTS: Final = 20
"""Number of decisions in which a barrier may be placed; a vehicle may stand in its place at first."""

BARRIER_SHIFTS: Final = (0, 7, -7, 4, -4, 2, -2)
"""Places of a barrier from that of the errand [m], tried in turns before the client speaks, and all in its sight.

A prop keeps 6 m from vehicles, so that one that stands in the way mostly leaves one of the places free.
"""


class StreetCloser(TypedPolicy[int]):
    """Ad-Wizard of talk tasks: closes the street that its errands name, and does nothing else.

    The state is the number of attempts.
    """

    def __init__(self, limits: SpaceLimits | None = None) -> None:
        """Prepares the policy; the sizes of the spaces default to those of `SpaceLimits`."""
        super().__init__(Role.AD_WIZARD, limits)

    def initial_state(self, seed: int, town: Town) -> int:
        """Returns the number of attempts so far, 0."""
        return 0

    def act(self, observation: ObservationMapping, state: int) -> tuple[AdWizardAction, int]:
        """Places a barrier unless there is one already."""
        place = closure_in(str(observation["tasks"]))
        if place is None or state >= MOST_ATTEMPTS or observation["props"][:, PropColumn.KIND].any():
            return AdWizardAction(), state
        lane, metres = place
        action = AdWizardAction(
            exception=ExceptionKind.PLACE_PROP,
            prop=PropKind.STREET_BARRIER,
            place=LanePosition(lane=lane, metres=metres + BARRIER_SHIFTS[state % len(BARRIER_SHIFTS)]),
        )
        return action, state + 1
