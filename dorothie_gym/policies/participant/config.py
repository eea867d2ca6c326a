"""Tunable numbers and traits of the scripted participant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.policies.persona import Directions, Persona, within
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.scripted_agent_limits import USUAL_SPEED, GuidanceConfig

if TYPE_CHECKING:
    from dorothie_gym.policies.mood import Mood

BACKSEAT = 0.22
"""Knowledge times talkativeness above which a participant also guides to known places; two in five do."""


@dataclass(frozen=True, kw_only=True)
class ParticipantConfig(GuidanceConfig):
    """Tunable numbers of the scripted participant, in addition to those of all guidance.

    No publication gives these values. They were set by hand in self-play in the built-in towns; a reason stands where
    there is one.

    Attributes:
        red_light_time: standstill after which a red light no longer explains it [s].
        last_stretch: distance to the goal within which a standstill is not attributed to a light [m].
        start_time: time that a car is given to start after a light has turned green [s].
        wait_distance: distance to the goal within which the car is not halted for news about tasks [m].
        thinking_time: duration of such a halt [s].
        report_delay: range of the delay before the completion of a task is reported [s].
        next_task_delay: pause before the next task if it does not follow at once [s].
        goes_first: probability that a new task on the way is done before the current one.
        announces_ahead: probability that the change of a later task is mentioned at once.
        tells_message: probability that the sender and the reason of a message are mentioned with the change.
        leaves_route: probability that the choice of the route is left to the car in words.
        unanswered_after: silence after which the participant asks whether the car has understood [s].
        describes_looks: probability that a place is also described by an object there.
        near_landmark: distance between a landmark and the goal within which it helps to describe the goal [m].
        turn_late_distance: distance at which a turn is announced even if the car has not asked [m].
        switch_time: time that the car is given for a lane change before the next instruction [s].
        take_over_distance: distance to a described goal at which guidance begins [m].
        corner_distance: distance to a junction within which a goal right after it is easily missed [m].
        behind_corner: distance from the junction to such a goal [m].
        careful_speeds: speeds requested where the goal is easily missed [km/h].
        manoeuvre_cost: extra cost of each lane change and U-turn on a route that must be described in words [m].
        run_up: minimum distance from a U-turn to the goal [m].
        run_up_per_lane: additional distance for each lane change in between [m].
        lane_return_time: time after which a repeated lane change counts as a return to the lane [s].
        omits_straight: lowest probability of leaving out the announcement to drive straight across a junction.
        way_round_cost: extra cost of each lane change and U-turn after failures [m].
        off_route: number of decisions off the route after which a new one is planned.
        missed_within: distance to the goal below which leaving the route counts as a miss [m].
        wrong_turn_detour: increase of the distance after which a wrong turn is pointed out [m].
        lost_detour: increase over the minimum distance after which the car counts as lost [m].
        lost_standstill: standstill after which guidance takes over [s].
        top_speed: largest speed expected of the car [m/s].
        slow_distance: distance to the goal within which an announced stop is timed [m].
        slow_speed: speed below which the participant does not ask for less speed [m/s].
        soon_speed: speed expected of a car that has just started or turned [m/s].
        short_stop: distance before the goal at which the car is stopped after a miss [m].
        aim: the same at first: a car that stops too late has to turn round twice [m].
        pull: expected acceleration of a car after a turn [m/s^2].
        ready_time: standstill after which a car near the goal gets its next instruction [s].
        nudge_time: time after an instruction to drive on a little in which no other follows [s].
        late_stop: distance past the goal beyond which the stop instruction is shortened [m].
        arrival_distance: distance to the goal within which other remarks are dropped [m].
        elsewhere_distance: distance to the goal beyond which a standing car is elsewhere [m].
        explains_order: probability that the order of two tasks is explained by naming the first one.
        nods_first: probability that a remark starts by acknowledging utterances that were heard before it.
        just_said: time after an answer within which the same question needs no other one [s].
        unsure: probability that a yes is preceded by hesitation.
        checked_within: time within which a question refers to the last instruction [s].
        repeat_memory: time within which a repetition by the car refers to the last utterance [s].
        usual_speed: speed requested when the weather has cleared up [km/h].
        weather_notice: time that the car is given to mention the weather first [s].
        long_stop: standstill after which the participant may ask for the reason [s].
        wonder_interval: minimum time between questions about unexpected behaviour [s].
        excuse_time: time for which an explanation excuses a standstill [s].
    """

    red_light_time: float = 60.0
    last_stretch: float = 45.0
    start_time: float = 8.0
    wait_distance: float = 80.0
    thinking_time: float = 9.0
    report_delay: tuple[float, float] = (0.5, 2.5)
    next_task_delay: float = 9.0
    goes_first: float = 0.6
    announces_ahead: float = 0.95
    tells_message: float = 0.8
    leaves_route: float = 0.06
    unanswered_after: float = 8.0
    describes_looks: float = 0.5
    near_landmark: float = 90.0
    turn_late_distance: float = 60.0
    switch_time: float = 13.0
    take_over_distance: float = 130.0
    corner_distance: float = 50.0
    behind_corner: float = 55.0
    careful_speeds: tuple[float, ...] = (10.0, 15.0, 15.0, 20.0)
    manoeuvre_cost: float = 60.0
    run_up: float = 45.0
    run_up_per_lane: float = 50.0
    lane_return_time: float = 30.0
    omits_straight: float = 0.95
    way_round_cost: float = 400.0
    off_route: int = 3
    missed_within: float = 15.0
    wrong_turn_detour: float = 60.0
    lost_detour: float = 350.0
    lost_standstill: float = 40.0
    top_speed: float = 11.0
    slow_distance: float = 20.0
    slow_speed: float = 5.0
    soon_speed: float = 8.0
    short_stop: float = 2.0
    aim: float = 0.8
    pull: float = 3.0
    ready_time: float = 1.6
    nudge_time: float = 7.0
    late_stop: float = 1.0
    arrival_distance: float = 60.0
    elsewhere_distance: float = 40.0
    explains_order: float = 0.85
    nods_first: float = 0.85
    just_said: float = 5.0
    unsure: float = 0.08
    checked_within: float = 8.0
    repeat_memory: float = 15.0
    usual_speed: float = float(USUAL_SPEED)
    weather_notice: float = 3.0
    long_stop: float = 8.0
    wonder_interval: float = 25.0
    excuse_time: float = 30.0


@dataclass(frozen=True, kw_only=True)
class ParticipantStyle:
    """Traits of a participant, drawn at the start of a session.

    Attributes:
        guides: probability of guidance to a place that the car may know.
        names_street: probability that a street is added to a place or a turn.
        hurries: probability that the next task follows in the same breath as the report of the last.
        patience: standstill after which the participant asks for the reason [s].
        chat: mean time between remarks unrelated to the task [s].
        waits: probability that a turn is announced only if the car asks, or shortly before the junction.
        hints: probability that a step is phrased as an explanation instead of an instruction.
        reasons: probability that a reason is given with a place or a step.
        aligns: probability of a question whether an utterance was understood.
        nods: probability that explanations of the car are acknowledged.
        curious: probability of a question why the car does something unexpected.
        notices: probability that a conspicuous change of the weather, or a crowd, is mentioned.
        puzzled: probability that the participant has missed words that the car said during its own utterance.
        points_out: probability that a car is stopped by the statement that this is the place.
        thanks: probability that an answer of the car is acknowledged.
        verifies: probability of asking whether the car knows a destination after naming it.
        leads: probability that guidance to an unknown place begins right after its description.
        foresight: largest number of steps of the way that are described at once.
        manner: manner of giving directions.
        endings: probability that the end of an approach is described by what stands there.
        corrects: probability of a remark to a car that approaches its turn too fast.
        recalls: probability that a destination is introduced by what happened there, or close to it, on this trip.
    """

    guides: float
    names_street: float
    hurries: float
    patience: float
    chat: float
    waits: float = 0.0
    hints: float = 0.0
    reasons: float = 0.0
    aligns: float = 0.0
    nods: float = 0.2
    curious: float = 0.0
    notices: float = 0.0
    puzzled: float = 0.0
    points_out: float = 0.0
    thanks: float = 0.0
    verifies: float = 0.0
    leads: float = 0.12
    foresight: float = 1.0
    manner: Directions = Directions.TURNS
    endings: float = 0.5
    corrects: float = 0.5
    recalls: float = 0.5

    @classmethod
    def of(cls, persona: Persona, rng: np.random.Generator) -> ParticipantStyle:
        """Returns the style of a persona; the random generator adds individual variation."""
        precise, vague = persona.directions is Directions.TURNS, persona.directions is Directions.VAGUE
        landmarks = persona.directions is Directions.LANDMARKS
        plans = persona.directions is not Directions.VAGUE
        by_turns = persona.knowledge * persona.talkativeness > BACKSEAT
        return cls(
            guides=0.35 if by_turns else 0.06,
            names_street=within(0.0, 0.5, persona.knowledge, rng) + 0.25 * precise,
            hurries=within(0.6, 0.12, persona.patience, rng),
            patience=within(7.0, 14.0, persona.patience, rng),
            chat=within(105.0, 45.0, (persona.talkativeness + persona.humour) / 2.0, rng),
            waits=within(0.15, 0.5, persona.patience, rng) * (1.0 - 0.5 * landmarks) + 0.4 * vague,
            hints=within(0.3, 0.7, persona.politeness, rng) + 0.2 * landmarks,
            reasons=within(0.2, 0.55, persona.talkativeness, rng) + 0.15 * landmarks,
            aligns=within(0.15, 0.0, persona.certainty, rng),
            nods=within(0.65, 0.95, persona.politeness, rng),
            curious=within(0.02, 0.25, persona.attention, rng),
            puzzled=within(0.35, 0.0, persona.certainty, rng),
            points_out=within(0.5, 0.85, persona.politeness, rng) + 0.15 * landmarks,
            thanks=within(0.4, 0.9, persona.politeness, rng),
            verifies=within(0.3, 0.05, persona.certainty, rng),
            leads=within(0.3, 0.8, persona.knowledge, rng) if plans else 0.1,
            foresight=within(2.0, 4.9, persona.knowledge, rng) + 0.8 * landmarks
            if plans
            else within(1.0, 2.5, persona.knowledge, rng),
            manner=persona.directions,
            corrects=within(0.8, 0.2, persona.patience, rng),
            recalls=within(0.3, 0.9, persona.attention, rng),
            endings=0.85 if landmarks else 0.2 if vague else 0.5,
            notices=0.0 if persona.ignores else within(0.7, 1.0, persona.attention, rng),
        )

    def in_mood(self, mood: Mood) -> ParticipantStyle:
        """Returns the style as stress, hurry and mistrust change it."""
        return replace(
            self,
            guides=mood.likelier_without_trust(self.guides),
            aligns=mood.likelier_without_trust(self.aligns),
            curious=mood.likelier_without_trust(self.curious),
            hurries=mood.likelier_in_hurry(self.hurries),
            patience=self.patience * (1.0 - 0.5 * mood.stress),
            chat=self.chat * (1.0 + 2.0 * mood.stress),
            nods=mood.rarer(self.nods),
            reasons=mood.rarer(self.reasons),
            hints=mood.rarer(self.hints),
        )
