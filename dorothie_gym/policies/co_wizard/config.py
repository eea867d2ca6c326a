"""Tunable numbers and traits of the scripted Co-Wizard."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.policies.persona import Driving, Persona, within
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.scripted_agent_limits import NUDGE_DISTANCE, USUAL_SPEED

if TYPE_CHECKING:
    from dorothie_gym.policies.mood import Mood


@dataclass(frozen=True, kw_only=True)
class CoWizardConfig:
    """Tunable numbers of the scripted Co-Wizard.

    No publication gives these values. They were set by hand in self-play in the built-in towns; a reason stands where
    there is one.

    Attributes:
        turn_lead: distance to the junction at which a turn is commanded [m].
        passed: distance behind the car at which a place counts as passed and is no longer stopped at [m].
        command_interval: time after which a command without effect is repeated [s].
        straight_on_distance: distance to the junction at which a guided car goes straight on without an answer [m].
        pause_distance: distance before a junction at which a car without a known route stops [m].
        gentle_speed: speed of a gentle approach to a place or a turn [km/h].
        turn_ease_distance: distance to the junction at which a style that eases into turns slows down [m].
        gentle_distance: distance to the goal at which a gentle style slows down [m].
        held_up_after: time after which a hazard that stops the car is a reason to command a stop [s].
        place_sight: distance along the lanes ahead within which places are looked for [m].
        rest_time: duration of a stop for an obstruction [s].
        red_light_time: longest duration of a stop for a red light [s].
        replan_after: decisions off the route after which a new one is planned.
        red_light_extension: time for which a requested manoeuvre is kept after a red light [s].
        roadblock_sight: distance at which an obstacle is noticed [m].
        path_width: largest distance from the waypoints at which an obstacle is on the path [m].
        detour_by_street: probability that a proposed detour is named by its street.
        detour_answer_time: time after which a detour is taken without an answer [s].
        street_lanes: maximum number of lanes of a street that are compared to find the nearest.
        accepts_changes: probability that a change of tasks is accepted ("skipping Ikea") rather than only heard.
        accepts_goals: probability that a destination is accepted ("KFC it is") rather than only heard ("KFC, got it").
        search_silence: time without navigation instructions after which a described place is searched for [s].
        search_radius: distance to a guessed place at which the guess is given up [m].
        wish_time: time after which a requested manoeuvre that finds no room is given up [s].
        nudge_distance: distance driven for "a bit further" [m].
        recent_stop: time after a stop instruction within which the goal must be near [s].
        open_road_speed: lower requested speeds are temporary [km/h].
        slow_time: duration of a temporary speed [s].
        answer_time: time after a question within which an utterance is taken for the answer [s].
        pause_time: time after which the car drives on from a stop that was to be followed by driving on [s].
        long_standstill: standstill after which the first reason for it no longer counts [s].
        plan_junctions: junctions of the route that are searched for turns to mention.
        close_distance: distance within which a goal is called close [m].
        ask_distance: distance to the junction at which the Co-Wizard asks for the way [m].
        ask_interval: time after which a question about the way is repeated [s].
        goal_interval: time after which a question about the goal is repeated [s].
        hazard_delay: standstill after which a hazard is explained [s].
        hazard_interval: time between explanations of hazards [s].
        hazard_again: the same during one standstill [s].
        first_word: time at the start of a session in which the participant may speak first [s].
        next_delay: silence after which a Co-Wizard in a stationary car asks for the next task [s].
        start_delay: silence at the start of a session after which it asks for the first task [s].
        lost_variance: variance of the position above which the car does not know where it is [m^2].
        gps_variance: variance of the position that shows that it is not measured [m^2]; 0.02 to 0.15 while it is.
        found_variance: variance of the position below which it is measured again [m^2].
        contradictions: instructions against the route to a destination after which it is checked.
        looks_every: decisions after which the Co-Wizard looks around for changes to mention.
        looks_after: silence after which it does [s].
        remark_delay: time after which it says what it has seen, unless the participant does [s].
        leaves_weather: probability that mentioning the weather is left to the participant.
        accepts: probability that an instruction is accepted ("will do") rather than only heard ("okay").
    """

    turn_lead: float = 85.0
    passed: float = 2.0
    command_interval: float = 2.0
    straight_on_distance: float = 24.0
    pause_distance: float = 8.0
    gentle_speed: int = 20
    turn_ease_distance: float = 40.0
    gentle_distance: float = 70.0
    held_up_after: float = 0.4
    place_sight: float = 80.0
    rest_time: float = 4.0
    red_light_time: float = 45.0
    replan_after: int = 2
    red_light_extension: float = 15.0
    roadblock_sight: float = 70.0
    path_width: float = 1.8
    detour_by_street: float = 0.65
    detour_answer_time: float = 6.0
    street_lanes: int = 40
    accepts_changes: float = 0.8
    accepts_goals: float = 0.4
    search_silence: float = 15.0
    search_radius: float = 8.0
    wish_time: float = 30.0
    nudge_distance: float = NUDGE_DISTANCE
    recent_stop: float = 40.0
    open_road_speed: int = 25
    slow_time: float = 40.0
    answer_time: float = 12.0
    pause_time: float = 30.0
    long_standstill: float = 60.0
    plan_junctions: int = 6
    close_distance: float = 120.0
    ask_distance: float = 75.0
    ask_interval: float = 8.0
    goal_interval: float = 14.0
    hazard_delay: float = 5.0
    hazard_interval: float = 20.0
    hazard_again: float = 60.0
    first_word: float = 5.0
    next_delay: float = 4.0
    start_delay: float = 7.0
    lost_variance: float = 36.0
    gps_variance: float = 0.18
    found_variance: float = 0.08
    contradictions: int = 2
    looks_every: int = 8
    looks_after: float = 3.0
    remark_delay: float = 1.0
    leaves_weather: float = 0.25
    accepts: float = 0.45


@dataclass(frozen=True, kw_only=True)
class CoWizardStyle:
    """Traits of a Co-Wizard, drawn at the start of a session.

    Attributes:
        echoes: probability that an acknowledgement repeats the instruction.
        checks: probability that a place named without a street is checked.
        announces: probability that a manoeuvre of its own plan is announced.
        silent: probability that a plain instruction is not acknowledged.
        asks: probability of asking for the way where going straight on is possible.
        proposes: probability of proposing a way at a junction instead of asking for it.
        mishears: probability that an instruction is not understood.
        careful: probability of a stop before a junction while asking for the way.
        chats: probability that small talk is answered.
        eases: whether the car slows down well before turns.
        gentle: whether the car slows down well before a place on the map.
        rambles: probability that the current plan is mentioned along with another remark.
        offers: probability of proposing to do a task on the way first.
        notices: probability that a conspicuous change of the weather, or a crowd, is mentioned.
        recalls: probability of repeating the item or person of an errand, or mentioning it on arrival.
        pace: default cruise speed [km/h].
    """

    echoes: float
    checks: float
    announces: float
    silent: float
    asks: float = 0.5
    proposes: float = 0.0
    mishears: float = 0.0
    careful: float = 0.0
    chats: float = 0.0
    eases: bool = False
    gentle: bool = False
    rambles: float = 0.0
    offers: float = 0.0
    notices: float = 0.0
    recalls: float = 0.0
    pace: int = USUAL_SPEED

    @classmethod
    def of(cls, persona: Persona, rng: np.random.Generator) -> CoWizardStyle:
        """Returns the style of a persona; the random generator adds individual variation."""
        gentle, brisk = persona.driving is Driving.GENTLE, persona.driving is Driving.BRISK
        return cls(
            echoes=within(0.2, 0.5, persona.politeness, rng),
            checks=within(0.4, 0.1, persona.certainty, rng),
            announces=within(0.1, 0.4, persona.talkativeness, rng),
            silent=within(0.3, 0.1, persona.talkativeness, rng),
            asks=within(0.7, 0.3, persona.certainty, rng),
            proposes=within(0.1, 0.6, persona.certainty, rng),
            mishears=within(0.05, 0.0, persona.attention, rng),
            careful=within(0.9, 1.0, persona.patience, rng),
            eases=gentle or (not brisk and bool(rng.random() < 0.15)),
            gentle=gentle,
            rambles=within(0.05, 0.25, persona.talkativeness, rng),
            offers=within(0.3, 1.0, persona.attention, rng),
            pace=35 if gentle else int(rng.choice((40, 45))) if brisk else 40,
            chats=within(0.1, 0.6, persona.humour, rng),
            notices=0.0 if persona.ignores else within(0.6, 1.0, persona.attention, rng),
            recalls=within(0.1, 0.6, persona.attention, rng),
        )

    def in_mood(self, mood: Mood) -> CoWizardStyle:
        """Returns the style as stress and mistrust change it."""
        return replace(
            self,
            checks=mood.likelier_without_trust(self.checks),
            echoes=mood.likelier_without_trust(self.echoes),
            asks=mood.likelier_without_trust(self.asks),
            rambles=mood.rarer(self.rambles),
            chats=mood.rarer(self.chats),
            announces=mood.rarer(self.announces),
        )
