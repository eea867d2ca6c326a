import math

import numpy as np
import pytest

from dorothie_gym.dialogue import DrivingPlan, understand, word_acts
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.routes import StepAction
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps import LinkType, Town, load_town
from dorothie_gym.ontology import DialogueMove, ObjectClass, Role
from dorothie_gym.policies import ScriptedCoWizard, ScriptedParticipant
from dorothie_gym.policies.co_wizard.plan_points import Landing, find_point
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.participant.route_description import way_ahead, way_remarks
from dorothie_gym.policies.participant.target_hints import FAMOUS
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.persona import Directions
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.road_ahead import RoadAhead
from dorothie_gym.policies.route_progress import RouteProgress


class Drive:
    """Car at the start of a session, and what both speakers see."""

    def __init__(self, town: str | Town, seed: int) -> None:
        env = DuoWizardEnv(town=town)
        observations, _ = env.reset(seed=seed)
        self.town = env.town
        self.driver = ScriptedCoWizard(env.limits).initial_state(seed, env.town)
        names = observations["participant"]["street_names"]  # the car's map may lack some
        self.seen = CoWizardView.read({**observations["co_wizard"], "street_names": names}, env.town)
        self.view = ParticipantView.read(observations["participant"], env.town)
        self.state = ScriptedParticipant(env.limits).initial_state(seed, env.town)

    def ways(self, manner: Directions):
        """Yields the steps to each place, with the state of a participant who wants to go there."""
        for mark in self.view.landmarks:
            self.state.route = self.state.route.with_progress(
                RouteProgress.plan(self.town, self.view.place, mark.place)
            )
            self.state.task = replace(self.state.task, goal=mark)
            yield mark, way_ahead(self.state, self.view, 4, manner, np.random.default_rng(7))

    def said(self, steps, rng) -> str:
        """Returns the steps in words."""
        items = way_remarks(steps, DialogueMove.INSTRUCT)
        spans = word_acts([one.act for one in items], Role.PARTICIPANT, rng, [one.wording for one in items])
        return " ".join(span.text for span in spans)

    def junctions(self, plan: DrivingPlan) -> list[int]:
        """Returns the junctions at which the Co-Wizard would turn, as far as it can foresee them."""
        here, found = self.seen.here, []
        for step in plan:
            landing = find_point(self.driver, self.seen, RoadAhead.straight_on(self.town, here), step)
            assert isinstance(landing, Landing), f"{plan.describe()}: {landing}"
            found += [landing.due.junction] * (step.action is StepAction.TURN)
            if landing.behind is None:
                break
            here = landing.behind
        return found


@pytest.fixture(scope="module")
def drives():
    return [Drive(town, seed) for town in ("brookside", "midtown") for seed in (1, 2)]


def meant(drive: Drive, steps) -> list[int]:
    turns = [one.keys[-1] for one in steps if one.step.action is StepAction.TURN]
    return [max(way.junction_id for way in drive.town.exits(lane)) for _, lane, _ in turns]


@pytest.mark.parametrize("manner", list(Directions))
def test_the_listener_finds_the_junctions_of_the_route(drives, manner):
    rng, several = np.random.default_rng(3), 0
    for drive in drives:
        for _, steps in drive.ways(manner):
            if steps:
                several += len(steps) > 1
                text = drive.said(steps, rng)
                assert drive.junctions(understand(text).plan) == meant(drive, steps), text
    assert several >= 5


def named(drives, manner, field):
    steps = [one.step for drive in drives for _, way in drive.ways(manner) for one in way]
    return [place for step in steps for place in step.places if getattr(place, field) is not None]


def test_each_manner_names_what_it_goes_by(drives):
    assert named(drives, Directions.LANDMARKS, "landmark")
    assert {place.object for place in named(drives, Directions.LANDMARKS, "object")} <= {
        ObjectClass.TRAFFIC_LIGHT,
        ObjectClass.TRAFFIC_SIGN,
    }
    assert named(drives, Directions.STREETS, "street")
    assert not named(drives, Directions.VAGUE, "landmark")
    assert not named(drives, Directions.STREETS, "landmark")


def test_only_known_places_other_than_the_goal_are_named(drives):
    for drive in drives:
        for goal, steps in drive.ways(Directions.LANDMARKS):
            for name in (place.landmark for one in steps for place in one.step.places if place.landmark is not None):
                assert name in FAMOUS and name is not goal.name
                assert sum(mark.name is name for mark in drive.view.landmarks) == 1


def test_points_of_the_compass_are_those_of_the_map(drives):
    points = {"east": 0.0, "north": 90.0, "west": 180.0, "south": 270.0}
    found = 0
    for drive in drives:
        for one in (one for _, way in drive.ways(Directions.COMPASS) for one in way if one.wording.compass):
            connector = one.keys[-1][2]
            lane = next(way.lane for way in drive.town.exits(one.keys[-1][1]) if way.connector == connector)
            heading = math.degrees(drive.town.lanes[lane].headings[0])
            assert math.cos(math.radians(heading - points[one.wording.compass])) > math.cos(math.radians(31.0))
            found += 1
    assert found


def test_no_more_steps_than_asked_for(drives):
    for drive in drives:
        for _ in drive.ways(Directions.TURNS):
            for count in (1, 2):
                steps = way_ahead(drive.state, drive.view, count, Directions.TURNS, np.random.default_rng(0))
                assert len(steps) <= count


def test_a_turn_back_at_a_junction_is_not_described_as_a_turn_to_a_side() -> None:
    """SUMO's maps have such turns, also at junctions with lights."""
    town = load_town("brookside")
    links = [replace(link, type=LinkType.U_TURN) if link.type is LinkType.LEFT else link for link in town.links]
    parts = ("lanes", "junctions", "streets", "sites", "signals", "crosswalks", "sidewalks", "programmes")
    drive = Drive(Town(name="back", links=links, **{part: getattr(town, part) for part in parts}), 3)
    said = [step.step for manner in Directions for _, way in drive.ways(manner) for step in way]
    assert said and all(step.direction is not Direction.BACK for step in said)
