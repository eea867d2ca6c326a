"""State of the scripted Co-Wizard between decisions: dialogue, beliefs, route, intentions and commands.

Each group is frozen. Its methods are the only places where its fields change, and each returns a new group. A step
works on a shallow copy of `CoWizardState` and replaces whole groups in it; the state handed in is not changed.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

from dorothie_gym.dialogue.propositions import Proposition
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import Sensor
from dorothie_gym.policies.co_wizard.beliefs import BeliefState
from dorothie_gym.policies.co_wizard.config import CoWizardConfig, CoWizardStyle
from dorothie_gym.policies.co_wizard.intentions import Directive, Intentions, Wish
from dorothie_gym.policies.co_wizard.plan_memory import PlanMemory
from dorothie_gym.policies.knowledge import TOLD_TO_STOP, CoWizardKnowledge, Standstill
from dorothie_gym.policies.notable_conditions import Noticed
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_state import RouteState
from dorothie_gym.policies.speech import SpeakingState

SAYS_WHEN = re.compile(r"\b(say|tell you|let you know) (when|where to stop)\b", re.I)
"""Words by which a participant asks for no questions until it speaks again."""


@dataclass(frozen=True, kw_only=True)
class DialogueState:
    """State of the dialogue: questions asked, and topics mentioned.

    Attributes:
        heard_at: time of the last utterance of the participant [s].
        asked_at: time of the last question of the Co-Wizard [s].
        asked_lane: lane before the junction that the last question about the way referred to, -1 for none.
        way_asks: number of questions about the way since the participant was last heard.
        considered_lane: lane before the last junction for which the Co-Wizard has decided whether to ask, -1 for none.
        idle_since: start of the period without any task or instruction [s].
        steered_at: time of the last navigation instruction [s].
        sent_on_at: time at which the participant has last said that it will say when [s].
        stop_instructed_at: time of the last instruction to stop [s].
        stop_reason: reason for that stop: an instruction, or a description of the place.
        u_turn_instructed_at: time of the last instruction to turn round [s].
        orders: latest U-turns and lane changes that the participant requested, with their times [s].
        proposed: turn proposed to the participant and not answered yet.
        offer: place proposed as the first destination and not answered yet.
        offered_street: street proposed to drive to and not answered yet.
        slower: speed that was proposed and not answered yet [km/h].
        blocked_at: time at which an obstacle across the road was last found [s].
        detour_asked_at: time of the open question about a detour [s]; None where none is open.
        hazard_explained_at: time of the last explanation of a hazard [s].
        weather_mentioned: whether the current bad weather has been mentioned.
        noticed: weather and crowds that have been noticed.
        lost_mentioned: whether the current loss of localization has been mentioned.
        contradicted: destination against whose route instructions were given, and how often; it may be misheard.
        view_fault: fault of the camera that has been noticed and is not over.
    """

    heard_at: float = -math.inf
    asked_at: float = -math.inf
    asked_lane: int = -1
    way_asks: int = 0
    considered_lane: int = -1
    idle_since: float = 0.0
    steered_at: float = -math.inf
    sent_on_at: float = -math.inf
    stop_instructed_at: float = -math.inf
    stop_reason: Proposition = TOLD_TO_STOP
    u_turn_instructed_at: float = -math.inf
    orders: tuple[tuple[ActionValue, float], ...] = ()
    proposed: Directive | None = None
    offer: LandmarkName | None = None
    offered_street: StreetName | None = None
    slower: int | None = None
    blocked_at: float = -math.inf
    detour_asked_at: float | None = None
    hazard_explained_at: float = -math.inf
    weather_mentioned: bool = False
    noticed: Noticed = field(default_factory=Noticed)
    lost_mentioned: bool = False
    contradicted: tuple[LandmarkName | None, int] = (None, 0)
    view_fault: Sensor | None = None

    def after_hearing(self, now: float, text: str = "") -> DialogueState:
        """Records an utterance of the participant at `now` [s]."""
        sent_on = now if SAYS_WHEN.search(text) else -math.inf
        return replace(self, heard_at=now, idle_since=now, way_asks=0, sent_on_at=sent_on)

    def after_asking(self, now: float) -> DialogueState:
        """Records a question of the Co-Wizard at `now` [s]."""
        return replace(self, asked_at=now)

    def after_considering(self, lane: int) -> DialogueState:
        """Records the decision whether to ask for the way at the end of a lane."""
        return replace(self, considered_lane=lane)

    def after_asking_way(self, lane: int, now: float) -> DialogueState:
        """Records a question about the way at the end of a lane."""
        return replace(self, asked_lane=lane, asked_at=now, way_asks=self.way_asks + 1)

    def asking_way_again(self) -> DialogueState:
        """Allows another question about the way at the current junction at once."""
        return replace(self, asked_lane=-1)

    def after_steering(self, now: float) -> DialogueState:
        """Records a navigation instruction at `now` [s]."""
        return replace(self, steered_at=now)

    def after_stop_instruction(self, now: float, reason: Proposition = TOLD_TO_STOP) -> DialogueState:
        """Records an instruction to stop at `now` [s], and the reason for it."""
        return replace(self, stop_instructed_at=now, stop_reason=reason)

    def after_u_turn_instruction(self, now: float) -> DialogueState:
        """Records an instruction to turn round at `now` [s]."""
        return replace(self, u_turn_instructed_at=now)

    def after_order(self, action: ActionValue, now: float, since: float, *, done_at: float) -> DialogueState:
        """Records an order, in place of an equal one that was not carried out.

        Args:
            action: the action.
            now: time of the order [s].
            since: time before which orders are forgotten [s].
            done_at: time at which a manoeuvre was last carried out [s].
        """
        kept = (pair for pair in self.orders if pair[1] >= since and (pair[0] is not action or pair[1] <= done_at))
        return replace(self, orders=(*kept, (action, now)))

    def with_orders_settled(self) -> DialogueState:
        """Forgets the latest orders, for a new goal or another route."""
        return replace(self, orders=())

    def busy(self, now: float) -> DialogueState:
        """Restarts the period without a task at `now` [s]."""
        return replace(self, idle_since=now)

    def with_proposal(self, directive: Directive | None) -> DialogueState:
        """Opens the proposal of a turn; None withdraws it."""
        return replace(self, proposed=directive)

    def with_offer(self, place: LandmarkName | None) -> DialogueState:
        """Opens the proposal of a first destination; None withdraws it."""
        return replace(self, offer=place)

    def with_offered_street(self, street: StreetName | None) -> DialogueState:
        """Opens the proposal to drive to a street; None withdraws it."""
        return replace(self, offered_street=street)

    def with_slower(self, speed: int | None) -> DialogueState:
        """Opens the proposal of a lower speed [km/h]; None closes it."""
        return replace(self, slower=speed)

    def with_view_fault(self, sensor: Sensor | None) -> DialogueState:
        """Sets the fault of the camera that has been noticed; None if there is none."""
        return replace(self, view_fault=sensor)

    def after_refusal(self) -> DialogueState:
        """Closes all proposals."""
        return replace(self, proposed=None, offer=None, offered_street=None, slower=None)

    def with_detour_question(self, asked_at: float | None) -> DialogueState:
        """Opens the question about a detour at a time [s]; None closes it."""
        return replace(self, detour_asked_at=asked_at)

    def after_finding_obstacle(self, now: float) -> DialogueState:
        """Records that an obstacle across the road was found and explained at `now` [s]."""
        return replace(self, blocked_at=now, hazard_explained_at=now)

    def after_explaining_hazard(self, now: float) -> DialogueState:
        """Records that a hazard was explained at `now` [s]."""
        return replace(self, hazard_explained_at=now)

    def with_weather_mentioned(self, mentioned: bool) -> DialogueState:
        """Sets whether the current weather has been mentioned."""
        return replace(self, weather_mentioned=mentioned)

    def with_noticed(self, noticed: Noticed) -> DialogueState:
        """Sets the noticed weather and crowds."""
        return self if noticed is self.noticed else replace(self, noticed=noticed)

    def with_contradictions(self, goal: LandmarkName | None, count: int) -> DialogueState:
        """Sets how often instructions went against the route to a destination."""
        return replace(self, contradicted=(goal, count))

    def with_lost_mentioned(self, mentioned: bool) -> DialogueState:
        """Sets whether the current loss of localization has been mentioned."""
        return replace(self, lost_mentioned=mentioned)


@dataclass(frozen=True, kw_only=True)
class CommandState:
    """Commands given to the car and their observed effect.

    Attributes:
        turn_sent: lane and angle of the last turn commanded [-, degrees].
        turn_sent_at: time of that command [s].
        manoeuvre_sent_at: time of the last lane switch or U-turn command [s].
        manoeuvred_at: time at which the car was last seen to carry out one [s].
        stop_sent_at: time of the last Stop command [s].
        rest_until: end of a stop for an obstruction [s].
        rest_for: object that the car stops for.
        rest_decided: whether the Co-Wizard has decided about a stop at the current hazard.
        ready_at: time before which the Co-Wizard has not reacted to an instruction yet, except to stop [s].
    """

    turn_sent: tuple[int, int] = (-1, 0)
    turn_sent_at: float = -math.inf
    manoeuvre_sent_at: float = -math.inf
    manoeuvred_at: float = -math.inf
    stop_sent_at: float = -math.inf
    rest_until: float = -math.inf
    rest_for: ObjectClass = ObjectClass.UNLABELED
    rest_decided: bool = False
    ready_at: float = -math.inf

    def reacting_until(self, ready_at: float) -> CommandState:
        """Sets the end of the reaction to an instruction [s]."""
        return replace(self, ready_at=ready_at)

    def after_stop(self, now: float) -> CommandState:
        """Records a Stop command."""
        return replace(self, stop_sent_at=now)

    def after_manoeuvre(self, now: float) -> CommandState:
        """Records a lane switch or U-turn command."""
        return replace(self, manoeuvre_sent_at=now)

    def manoeuvring(self, now: float) -> CommandState:
        """Records that the car switches lanes or turns round."""
        return replace(self, manoeuvred_at=now)

    def after_turn(self, turn: tuple[int, int], now: float) -> CommandState:
        """Records a turn command: lane and angle [degrees]."""
        return replace(self, turn_sent=turn, turn_sent_at=now)

    def with_rest_decided(self, decided: bool) -> CommandState:
        """Sets whether the Co-Wizard has decided about a stop at the current hazard."""
        return replace(self, rest_decided=decided)

    def resting(self, until: float, hazard: ObjectClass) -> CommandState:
        """Stops for a hazard until a time [s]."""
        return replace(self, rest_until=until, rest_for=hazard)

    def rested(self, now: float) -> CommandState:
        """Ends the stop for a hazard."""
        return replace(self, rest_until=now)


@dataclass(kw_only=True)
class CoWizardState(SpeakingState[CoWizardStyle, CoWizardConfig]):
    """State of the scripted Co-Wizard; a step works on a shallow copy.

    Attributes:
        dialogue: course of the dialogue.
        beliefs: beliefs about destinations.
        route: route to the goal.
        intentions: driving goals of the next seconds.
        plan: driving plan that the participant has asked for.
        commands: commands given to the car.
        standstill: current or last standstill.
    """

    dialogue: DialogueState = field(default_factory=DialogueState)
    beliefs: BeliefState = field(default_factory=BeliefState)
    route: RouteState = field(default_factory=RouteState)
    intentions: Intentions
    plan: PlanMemory = field(default_factory=PlanMemory)
    commands: CommandState = field(default_factory=CommandState)
    standstill: Standstill = field(default_factory=Standstill)

    def leave_goal(self) -> None:
        """Removes the goal, its route and all that was intended for it."""
        self.beliefs = self.beliefs.without_goal()
        self.route = self.route.with_progress(None)
        self.intentions = self.intentions.without_goal()

    @property
    def knowledge(self) -> CoWizardKnowledge:
        """Beliefs and intentions."""
        beliefs, intentions, dialogue = self.beliefs, self.intentions, self.dialogue
        return CoWizardKnowledge(
            town=self.town,
            config=self.config,
            goal=beliefs.goal,
            goal_is_on_map=beliefs.exact,
            goal_is_findable=beliefs.exact or beliefs.described,
            progress=self.route.progress,
            ruled_out=beliefs.ruled_out,
            halted=intentions.halted,
            arrived=intentions.arrived,
            sent_on=intentions.sent_on,
            pausing=intentions.pausing,
            directed=intentions.directive is not None or bool(self.plan.steps),
            to_turn_round=intentions.wish is Wish.U_TURN,
            asks_for_detour=dialogue.detour_asked_at is not None,
            blocked_at=dialogue.blocked_at,
            told_to_stop_at=dialogue.stop_instructed_at,
            stop_reason=dialogue.stop_reason,
            told_to_turn_round_at=dialogue.u_turn_instructed_at,
            standstill=self.standstill,
            rests_for=self.commands.rest_for,
            rests_until=self.commands.rest_until,
            usual_speed=intentions.usual,
            cruise=intentions.cruise,
        )
