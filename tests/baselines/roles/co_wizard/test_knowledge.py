"""The scripted and the learned Co-Wizard judge alike where they know the same; what only one keeps is its property."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dorothie_gym.baselines.roles.co_wizard.memory import VARIABLES, WorkingMemory
from dorothie_gym.dialogue import Predicate, Proposition
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology import ActionValue, LandmarkName, ObjectClass, Role
from dorothie_gym.policies import ScriptedCoWizard
from dorothie_gym.policies.co_wizard.answers import judged, why_standing, why_turning_round
from dorothie_gym.policies.co_wizard.intentions import Directive, Wish
from dorothie_gym.policies.co_wizard.proposition_truth import believes, reason_to_stand, seconds_to_goal
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.knowledge import Standstill
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.policy import replace as with_changes
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.state.codes import Motion

NOWHERE = LandmarkName.PERSON
"""A place that is on no map."""


@pytest.fixture(scope="module")
def seen() -> tuple[CoWizardView, Town]:
    engine = SessionEngine("brookside")
    engine.reset(seed=4)
    observation = engine.observations.of([Role.CO_WIZARD])[str(Role.CO_WIZARD)]
    return with_changes(CoWizardView.read(observation, engine.town), time=30.0), engine.town


def scripted(town: Town) -> CoWizardState:
    return ScriptedCoWizard().initial_state(3, town)


def with_values(memory: WorkingMemory, **values: int) -> WorkingMemory:
    found = tuple(values.get(name, old) for name, old in zip(VARIABLES, memory.values, strict=True))
    return replace(memory, values=found)


def both(seen: tuple[CoWizardView, Town], place: LandmarkName | None) -> tuple[CoWizardState, WorkingMemory]:
    """Returns a scripted state and a learned memory with the same goal, on the map or not, and the same route."""
    view, town = seen
    state, memory = scripted(town), WorkingMemory(town=town)
    if place is None:
        return state, memory
    mark = next((one for one in view.landmarks if one.name is place), None)
    navigator = memory.navigator.to(town, view, None if mark is None else mark.place)
    memory = replace(memory, goal=place, goal_mark=-1 if mark is None else mark.row, navigator=navigator)
    state.beliefs = (
        state.beliefs.with_unknown_goal(place) if mark is None else state.beliefs.with_known_goal(place, mark.place)
    )
    state.route = state.route.with_progress(navigator.route.progress)
    return state, memory


def known_place(view: CoWizardView) -> LandmarkName:
    return next(mark.name for mark in view.landmarks if sum(one.name is mark.name for one in view.landmarks) == 1)


def propositions(view: CoWizardView, town: Town, place: LandmarkName) -> list[Proposition]:
    mark = next(one for one in view.landmarks if one.name is place)
    here, other = street_of(view.raw, town, view.lane), mark.street
    return [
        *(Proposition.of(Predicate.SEES, object=kind) for kind in ObjectClass),
        *(Proposition.of(Predicate.ON_STREET, street=street) for street in (here, other)),
        *(Proposition.of(Predicate.LOCATED, place=place, street=street) for street in (here, other)),
        *(Proposition.of(Predicate.CROWDED, object=kind) for kind in (ObjectClass.VEHICLES, ObjectClass.PEDESTRIAN)),
        *(Proposition.of(Predicate.DOES, action=action) for action in (ActionValue.STOP, ActionValue.U_TURN)),
        *(
            Proposition.of(predicate)
            for predicate in (Predicate.BLOCKED, Predicate.SAFE, Predicate.FAILED, Predicate.RED)
        ),
        *(
            Proposition.of(predicate, negated=negated, place=about)
            for predicate in (
                Predicate.CLOSE,
                Predicate.HAS_ROUTE,
                Predicate.RIGHT_WAY,
                Predicate.ARRIVED,
                Predicate.GOAL,
            )
            for negated in (False, True)
            for about in (None, place, NOWHERE)
        ),
    ]


@pytest.mark.parametrize("goal", ["on the map", "elsewhere", "none"])
def test_scripted_and_learned_hold_the_same_for_true(seen: tuple[CoWizardView, Town], goal: str) -> None:
    view, town = seen
    place = known_place(view)
    state, memory = both(seen, {"on the map": place, "elsewhere": NOWHERE, "none": None}[goal])
    found = set()
    for said in propositions(view, town, place):
        held = believes(memory.knowledge, view, said)
        assert held is believes(state.knowledge, view, said), said
        assert judged(memory.knowledge, view, said) == judged(state.knowledge, view, said)
        found.add(held)
    assert found == {True, False, None}
    assert seconds_to_goal(memory.knowledge, view) == seconds_to_goal(state.knowledge, view)
    assert (seconds_to_goal(memory.knowledge, view) is not None) is (goal == "on the map")


def halted(state: CoWizardState, memory: WorkingMemory) -> tuple[CoWizardState, WorkingMemory]:
    state.intentions = state.intentions.halting()
    state.dialogue = state.dialogue.after_stop_instruction(28.0)
    state.standstill = Standstill(since=29.0)
    return state, replace(with_values(memory, halted=1), told_to_stop_at=28.0, standstill=Standstill(since=29.0))


def arrived(state: CoWizardState, memory: WorkingMemory) -> tuple[CoWizardState, WorkingMemory]:
    state.intentions = state.intentions.stopped_at_place(arrived=True, sent_on=False)
    return state, with_values(memory, arrived=1, halted=1)


def pausing(state: CoWizardState, memory: WorkingMemory) -> tuple[CoWizardState, WorkingMemory]:
    state.intentions = state.intentions.with_pause(True)
    return state, with_values(memory, pausing=1)


def before_obstacle(state: CoWizardState, memory: WorkingMemory) -> tuple[CoWizardState, WorkingMemory]:
    state.dialogue = state.dialogue.with_detour_question(29.0).after_finding_obstacle(29.0)
    return with_directive(state), replace(
        with_values(memory, detour=1, order=1), navigator=replace(memory.navigator, blocked_at=29.0)
    )


def turning_round(state: CoWizardState, memory: WorkingMemory) -> tuple[CoWizardState, WorkingMemory]:
    state.intentions = replace(state.intentions, wish=Wish.U_TURN)
    return state, with_values(memory, manoeuvre=1)


def with_directive(state: CoWizardState) -> CoWizardState:
    state.intentions = state.intentions.directed(Directive(direction=None))
    return state


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (halted, Predicate.TOLD),
        (arrived, Predicate.ARRIVED),
        (pausing, Predicate.HAS_ROUTE),
        (before_obstacle, Predicate.BLOCKED),
        (turning_round, None),
    ],
)
@pytest.mark.parametrize("hazard", [ObjectClass.UNLABELED, ObjectClass.PEDESTRIAN])
def test_scripted_and_learned_give_the_same_reasons(seen, change, reason, hazard) -> None:  # type: ignore[no-untyped-def]
    view, _ = seen
    stands = with_changes(view, speed=0.0, motion=Motion.HAZARD if hazard else Motion.STOPPED, hazard=hazard)
    state, memory = change(*both(seen, known_place(view)))
    assert reason_to_stand(memory.knowledge, stands) == reason_to_stand(state.knowledge, stands)
    assert why_standing(memory.knowledge, stands) == why_standing(state.knowledge, stands)
    assert why_turning_round(memory.knowledge, stands) == why_turning_round(state.knowledge, stands)
    found = reason_to_stand(memory.knowledge, stands)
    if hazard is ObjectClass.UNLABELED:
        assert (None if found is None else found.predicate) is reason
    told = why_turning_round(memory.knowledge, stands).meaning[0].get("cause")
    assert isinstance(told, Proposition)
    expected = {turning_round: Predicate.TOLD, before_obstacle: Predicate.BLOCKED}.get(change, Predicate.BEHIND)
    assert told.predicate is expected


def test_only_the_scripted_one_keeps_what_was_described_and_what_it_rests_for(seen: tuple[CoWizardView, Town]) -> None:
    view, _ = seen
    place = known_place(view)
    state, memory = both(seen, place)
    state.beliefs, memory = state.beliefs.without_place(), replace(memory, goal_mark=-1)
    knows = Proposition.of(Predicate.KNOWS, place=place)
    held: list[bool | None] = [believes(one.knowledge, view, knows) for one in (state, memory)]
    assert held == [False, True]
    state.beliefs = state.beliefs.with_description()
    assert believes(state.knowledge, view, knows) is True
    stands = with_changes(view, speed=0.0, motion=Motion.STOPPED)
    state.commands = state.commands.resting(40.0, ObjectClass.VEHICLES)
    hinders = Proposition.of(Predicate.HINDERS, object=ObjectClass.VEHICLES)
    reasons = [reason_to_stand(one.knowledge, stands) for one in (state, with_values(memory, resting=1))]
    assert reasons[0] == hinders and reasons[1] != hinders


def test_standstill_keeps_its_reason_until_the_car_has_driven() -> None:
    blocked, told = (Proposition.of(one) for one in (Predicate.BLOCKED, Predicate.TOLD))
    stands = Standstill(since=None).observed(5.0, standing=True).with_reason(blocked, 6.0)
    assert (stands.since, stands.reason, stands.reason_since) == (5.0, blocked, 6.0)
    kept = stands.observed(8.0, standing=True).with_reason(None, 8.0).with_reason(blocked, 9.0)
    assert kept == stands, "a reason that is not known any more stays, with its time"
    drives = kept.observed(10.0, standing=False)
    assert (drives.since, drives.until, drives.reason) == (None, 10.0, blocked)
    assert drives.observed(11.0, standing=False).until == 10.0
    again = drives.observed(20.0, standing=True)
    assert (again.since, again.until, again.reason) == (20.0, 10.0, None)
    assert again.with_reason(told, 21.0).reason_since == 21.0
