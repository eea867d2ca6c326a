"""Beliefs of the scripted Co-Wizard about destinations, and the updates that report them to the environment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dorothie_gym.dialogue.looks import Appearance
from dorothie_gym.dialogue.propositions import Proposition
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology.actions import MentalAction
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, StreetName
from dorothie_gym.policies.policy import replace
from dorothie_gym.session.spaces.actions import LanePosition, Mental


@dataclass(frozen=True, kw_only=True)
class BeliefState:
    """Beliefs about destinations, and the belief updates that the environment has not received yet.

    Attributes:
        goal: landmark of the current destination.
        place: believed place of the goal.
        exact: whether `place` is taken from the map; otherwise it is a guess.
        described: whether the participant has described where the goal, which is not on the map, lies.
        statuses: known status of landmarks.
        plan: junctions of the route as sent in the last plan update.
        ruled_out: places of houses and people that were visited, or that were not the ones meant.
        updates: belief updates (mental actions) to be sent, the next first.
        told: purposes of errands that the participant has stated, most recent last.
        sent_goal: landmark of the last goal update with a guessed place.
        owner: person whose house is the goal, according to the participant; None if it is not a house, or a house
            without a named owner.
        friend: name of the person who is the goal, according to the participant; None without one.
        streets: streets on which the goal that is not on the map lies, according to the participant.
        look: look of the goal as the participant has described it.
    """

    goal: LandmarkName | None = None
    place: Place | None = None
    exact: bool = False
    described: bool = False
    plan: tuple[int, ...] = ()
    statuses: tuple[tuple[LandmarkName, GoalStatus], ...] = ()
    ruled_out: tuple[Place, ...] = ()
    updates: tuple[Mental, ...] = ()
    told: tuple[Proposition, ...] = ()
    sent_goal: LandmarkName | None = None
    owner: str | None = None
    friend: str | None = None
    streets: tuple[StreetName, ...] = ()
    look: Appearance | None = None

    @property
    def stop_place(self) -> Place | None:
        """Place of the goal if it is known from the map."""
        return self.place if self.exact else None

    def with_update(self, update: Mental) -> BeliefState:
        """Queues a belief update, unless an equal one is queued already."""
        return self if update in self.updates else replace(self, updates=(*self.updates, update))

    def with_told(self, told: Proposition) -> BeliefState:
        """Records the participant's statement about an errand."""
        return replace(self, told=(*self.told, told))

    def with_owner(self, owner: str | None) -> BeliefState:
        """Sets the person whose house is the goal."""
        return replace(self, owner=owner)

    def with_friend(self, friend: str | None) -> BeliefState:
        """Sets the name of the person who is the goal."""
        return replace(self, friend=friend)

    def after_sending(self) -> BeliefState:
        """Removes the first queued update."""
        return replace(self, updates=self.updates[1:])

    def with_status(self, landmark: LandmarkName, status: GoalStatus) -> BeliefState:
        """Sets the status of a landmark and queues the update."""
        statuses = (*(pair for pair in self.statuses if pair[0] is not landmark), (landmark, status))
        update = Mental(action=MentalAction.STATUS_UPDATE, landmark=landmark, status=status)
        return replace(self, statuses=statuses).with_update(update)

    def with_known_goal(self, landmark: LandmarkName, place: Place) -> BeliefState:
        """Sets a goal whose place is on the map."""
        look = self.look if landmark is self.goal else None
        return replace(self, goal=landmark, place=place, exact=True, sent_goal=None, look=look)

    def with_unknown_goal(self, landmark: LandmarkName, streets: Sequence[StreetName] = ()) -> BeliefState:
        """Sets a goal whose place is not on the map, and its streets; a description of the same goal stays valid."""
        again = self.goal is landmark and not self.exact
        described, look = again and self.described, self.look if again else None
        told = tuple(streets) or (self.streets if again else ())
        goal = replace(self, goal=landmark, place=None, exact=False, described=described, plan=(), look=look)
        return replace(goal, streets=told)

    def with_goal_ahead(self, landmark: LandmarkName | None) -> BeliefState:
        """Marks the goal as close ahead at a place that is not exactly known; `landmark` renames it."""
        return replace(self, goal=self.goal if landmark is None else landmark, exact=False)

    def with_guess(self, landmark: LandmarkName, place: Place) -> BeliefState:
        """Sets the guessed place of a landmark and queues the updates; earlier guesses are no longer sent."""
        where = LanePosition(lane=place[0], metres=round(place[1]))
        guess = Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=landmark, place=where)
        others = (update for update in self.updates if update.action is not MentalAction.KNOWLEDGE_UPDATE)
        updated = replace(self, place=place, updates=(*others, guess), sent_goal=landmark)
        if landmark is self.sent_goal:
            return updated
        return updated.with_update(Mental(action=MentalAction.GOAL_UPDATE, goals=(landmark,)))

    def with_plan(self, junctions: tuple[int, ...]) -> BeliefState:
        """Sets the plan, junctions on the route, and queues the update unless it is empty or was sent already."""
        if junctions == self.plan or not junctions:
            return self
        return replace(self, plan=junctions).with_update(Mental(action=MentalAction.PLAN_UPDATE, plan=junctions))

    def with_description(self) -> BeliefState:
        """Records that the participant has described where the goal lies."""
        return replace(self, described=True)

    def with_look(self, look: Appearance) -> BeliefState:
        """Adds to the look of the goal."""
        return replace(self, look=look if self.look is None else self.look.joined(look))

    def without_look(self) -> BeliefState:
        """Forgets the look of the goal, which belongs to another house or person."""
        return replace(self, look=None)

    def with_place_ruled_out(self) -> BeliefState:
        """Excludes the current place as a candidate for the name of its landmark."""
        return self if self.place is None else replace(self, ruled_out=(*self.ruled_out, self.place))

    def without_place(self) -> BeliefState:
        """Forgets the place of the goal and the plan that led there."""
        return replace(self, place=None, exact=False, plan=())

    def without_goal(self) -> BeliefState:
        """Removes the goal."""
        return replace(self, goal=None, place=None, exact=False, plan=(), sent_goal=None, look=None)
