"""Estimates of hidden places from marks on the map and from statements."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    LandmarkName,
    MentalAction,
    Role,
    SlotValue,
    StreetName,
)
from dorothie_gym.session.beliefs import BeliefTracker
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.scenario import Scenario, draw_scenario
from dorothie_gym.session.spaces import (
    CoWizardAction,
    GuessColumn,
    LanePosition,
    Mental,
    ParticipantAction,
    Speech,
    noop,
)
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.tasks import Landmark

TOWN = load_town("brookside")
FAR = np.array([1e4, 1e4, 0.0])
SURE = 0.01 * np.eye(3)


def scenario_with_neighbours() -> tuple[Scenario, Landmark, Landmark]:
    """Returns a scenario with a hidden landmark close to a known one on a street; both names are unique."""
    for seed in range(500):
        scenario = draw_scenario(TOWN, None, seed)
        landmarks = scenario.storyboard.landmarks
        names = [mark.name for mark in landmarks]
        alone = [mark for mark in landmarks if names.count(mark.name) == 1]
        for one in alone:
            for other in alone:
                if (
                    one.hidden
                    and one.street >= 0
                    and not other.hidden
                    and math.dist(one.position, other.position) < 60.0
                ):
                    return scenario, one, other
    raise AssertionError("no scenario hides a landmark beside a known one")


SCENARIO, HIDDEN, KNOWN = scenario_with_neighbours()
LANDMARKS = SCENARIO.storyboard.landmarks
STREET = SCENARIO.street_names[HIDDEN.street]


def beliefs() -> BeliefTracker:
    return BeliefTracker(TOWN, SCENARIO)


def say(held: BeliefTracker, move: DialogueMove, *values: SlotValue, by: Role = Role.PARTICIPANT) -> None:
    held.hear(by, [DialogueAct.of(move, *values)])


def mark(held: BeliefTracker, lane: int, station: float, pose: np.ndarray = FAR, sight: float = 80.0) -> None:
    held.guess(HIDDEN.name, lane, station, pose=pose, covariance=SURE, sight=sight)


def spread(held: BeliefTracker) -> float:
    return float(np.trace(np.array(held.places[HIDDEN.name].covariance)))


def test_named_street_locates_landmark() -> None:
    held = beliefs()
    say(held, DialogueMove.EXPLAIN, HIDDEN.name, STREET)
    place = held.places[HIDDEN.name]
    assert place.distance(*HIDDEN.position) < 9.0
    assert not held.guesses


def test_answer_without_name_refers_to_last_topic() -> None:
    held = beliefs()
    say(held, DialogueMove.QUERY_W, HIDDEN.name, by=Role.CO_WIZARD)
    say(held, DialogueMove.REPLY_W, STREET)
    named = beliefs()
    say(named, DialogueMove.REPLY_W, HIDDEN.name, STREET)
    assert held.places == named.places


def test_named_neighbour_narrows_estimate() -> None:
    held = beliefs()
    say(held, DialogueMove.EXPLAIN, HIDDEN.name, STREET)
    before = spread(held)
    say(held, DialogueMove.REPLY_W, HIDDEN.name, KNOWN.name)
    assert spread(held) < before


def test_repeated_statement_adds_no_information() -> None:
    held = beliefs()
    say(held, DialogueMove.EXPLAIN, HIDDEN.name, STREET)
    say(held, DialogueMove.EXPLAIN, HIDDEN.name, KNOWN.name)
    before = dict(held.places)
    say(held, DialogueMove.CLARIFY, HIDDEN.name, STREET)
    assert held.places == before


@pytest.mark.parametrize(
    ("move", "values", "speaker"),
    [
        (DialogueMove.INSTRUCT, (ActionValue.J_TURN, STREET), Role.PARTICIPANT),  # a turn, not a place
        (DialogueMove.QUERY_YN, (HIDDEN.name, STREET), Role.PARTICIPANT),
        (DialogueMove.REPLY_N, (HIDDEN.name, STREET), Role.PARTICIPANT),
        (DialogueMove.EXPLAIN, (HIDDEN.name, STREET), Role.CO_WIZARD),  # own statements add no information
        (DialogueMove.EXPLAIN, (HIDDEN.name, StreetName.UNKNOWN), Role.PARTICIPANT),
        (DialogueMove.EXPLAIN, (KNOWN.name, STREET), Role.PARTICIPANT),
    ],
)
def test_other_utterances_leave_estimates_unchanged(
    move: DialogueMove, values: tuple[SlotValue, ...], speaker: Role
) -> None:
    held = beliefs()
    say(held, move, *values, by=speaker)
    assert not held.places


def test_instruction_about_known_place_changes_topic() -> None:
    held = beliefs()
    say(held, DialogueMove.QUERY_W, HIDDEN.name, by=Role.CO_WIZARD)
    say(held, DialogueMove.INSTRUCT, KNOWN.name)
    say(held, DialogueMove.REPLY_W, STREET)
    assert HIDDEN.name not in held.places


def test_mark_in_sight_has_smaller_covariance() -> None:
    x, y = TOWN.lanes[HIDDEN.lane].position(HIDDEN.station)
    afar, near = beliefs(), beliefs()
    mark(afar, HIDDEN.lane, HIDDEN.station)
    mark(near, HIDDEN.lane, HIDDEN.station, pose=np.array([x + 15.0, y, 0.0]))
    fog = beliefs()
    mark(fog, HIDDEN.lane, HIDDEN.station, pose=np.array([x + 25.0, y, 0.0]), sight=20.0)
    assert spread(near) < spread(fog) == spread(afar)


def test_marks_and_statements_are_combined() -> None:
    held = beliefs()
    mark(held, HIDDEN.lane, HIDDEN.station)
    alone = spread(held)
    say(held, DialogueMove.EXPLAIN, HIDDEN.name, STREET)
    assert spread(held) < alone
    again = dict(held.places)
    mark(held, HIDDEN.lane, HIDDEN.station)  # the same mark
    assert held.places == again


def test_beliefs_do_not_depend_on_hidden_places() -> None:
    moved = tuple(replace(m, position=(m.position[0] + 50.0, m.position[1])) if m.hidden else m for m in LANDMARKS)
    other = replace(SCENARIO, storyboard=replace(SCENARIO.storyboard, landmarks=moved))
    found = []
    for scenario in (SCENARIO, other):
        held = BeliefTracker(TOWN, scenario)
        say(held, DialogueMove.EXPLAIN, HIDDEN.name, STREET, KNOWN.name)
        found.append(held.places)
    assert found[0] == found[1]


@pytest.mark.parametrize("observe_acts", [True, False])
def test_co_wizard_observes_mean_and_covariance(observe_acts: bool) -> None:
    env = DuoWizardEnv(
        "brookside", config=EnvConfig(observe_acts=observe_acts, world=WorldConfig(vehicles=0, pedestrians=0))
    )
    env.reset(seed=SCENARIO.seed)
    words = f"the {HIDDEN.name.label} is on {STREET.label}"
    act = DialogueAct.of(DialogueMove.EXPLAIN, HIDDEN.name, STREET)
    said = ParticipantAction(speech=Speech(act=act, text=words))
    place = LanePosition(lane=HIDDEN.lane, metres=round(HIDDEN.station))
    actions = {agent: noop(Role(agent), env.limits) for agent in env.agents}
    row = None
    for k in range(12):
        now = dict(actions)
        if k == 0:
            now["participant"] = said.encode(env.limits)
        if k == 10:
            marked = Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=HIDDEN.name, place=place)
            now["co_wizard"] = CoWizardAction(mental=marked).encode(env.limits)
        observations, *_ = env.step(now)
        if k == 9:
            row = observations["co_wizard"]["guesses"][HIDDEN.name.value].copy()
    last = observations["co_wizard"]["guesses"][HIDDEN.name.value]
    assert row is not None
    for told_row in (row, last):
        c = GuessColumn
        assert told_row[c.PRESENT] == 1.0
        covariance = np.array(
            [[told_row[c.VARIANCE_X], told_row[c.COVARIANCE_XY]], [told_row[c.COVARIANCE_XY], told_row[c.VARIANCE_Y]]]
        )
        assert np.linalg.eigvalsh(covariance)[0] > 0.0
    assert last[GuessColumn.VARIANCE_X] + last[GuessColumn.VARIANCE_Y] < row[3] + row[4]
    names = {LandmarkName(k) for k, guess in enumerate(observations["co_wizard"]["guesses"]) if guess[0]}
    assert names == {HIDDEN.name}
