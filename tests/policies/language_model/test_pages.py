"""What pages say about sight, faults, the position, obstacles on the way, and choices that came too late."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pytest

from dorothie_gym.ontology import AGENT_ROLES, ExceptionKind, ObjectClass, PropKind, Role, Sensor, WeatherParameter
from dorothie_gym.policies.language_model.turns import RoleTurns, TurnState
from dorothie_gym.policies.observation_parser import IN_VIEW
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import noop
from dorothie_gym.session.spaces.actions import AdWizardAction
from dorothie_gym.session.spaces.observations import ObservationMapping
from tests.policies.language_model.simple_readers import listed

SPEAKERS = (Role.CO_WIZARD, Role.PARTICIPANT)


class Drive:
    """Session of silent roles, with the pages that a role would see."""

    def __init__(self, role: Role, seed: int = 3) -> None:
        self.role, self.engine = role, SessionEngine("brookside")
        self.engine.reset(seed)
        self.turns = RoleTurns(role, self.engine.limits)
        self.state: TurnState = self.turns.begin(self.engine.town)

    def seen(self) -> ObservationMapping:
        observation = self.engine.observations.of([self.role])[str(self.role)]
        info = self.engine.info(self.role)
        return {**observation, **{name: info[name] for name in ("action_mask", "refusal_reason")}}

    def page(self) -> str:
        self.state = self.turns.attend(self.seen(), self.state)
        return self.turns.page(self.seen(), self.state)[0]

    def answer(self, **fields: str) -> None:
        _, schema = self.turns.page(self.seen(), self.state)
        given = {field.name: fields.get(field.name, field.default) for field in schema.fields}
        self.state = self.turns.answered(self.seen(), self.state, given)

    def step(self, ad_wizard: AdWizardAction | None = None) -> None:
        limits = self.engine.limits
        actions = {str(role): noop(role, limits) for role in AGENT_ROLES}
        self.state = self.turns.attend(self.seen(), self.state)
        actions[str(self.role)], self.state = self.turns.act(self.seen(), self.state)
        if ad_wizard is not None:
            actions["ad_wizard"] = ad_wizard.encode(limits)
        self.engine.step(actions)

    def run(self, seconds: float) -> Iterator[str]:
        for _ in range(round(2 * seconds)):
            self.step()
            yield self.page()


def broken(sensor: Sensor) -> AdWizardAction:
    return AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=sensor, on=True)


@pytest.mark.parametrize("role", SPEAKERS)
def test_page_tells_a_short_sight_and_its_cause(role: Role) -> None:
    drive = Drive(role)
    assert "Sight:" not in drive.page()
    drive.step(AdWizardAction(exception=ExceptionKind.WEATHER, weather=WeatherParameter.FOG_DENSITY, share=0.7))
    assert any(re.search(r"^Sight: about \d0 m; fog$", page, re.MULTILINE) for page in drive.run(30.0))


@pytest.mark.parametrize("role", SPEAKERS)
def test_page_tells_what_a_fault_of_the_camera_leaves(role: Role) -> None:
    drive = Drive(role)
    drive.step(broken(Sensor.VIEW))
    assert any("the camera of the car shows no picture" in page for page in drive.run(3.0))


def test_only_the_driver_is_told_that_the_position_is_estimated() -> None:
    for role in SPEAKERS:
        drive = Drive(role)
        assert "Position:" not in drive.page()
        drive.step(broken(Sensor.GPS))
        told = [page for page in drive.run(20.0) if "Position: only estimated" in page]
        assert bool(told) == (role is Role.CO_WIZARD)


@pytest.mark.parametrize("role", SPEAKERS)
def test_page_lists_what_is_in_sight_with_its_direction(role: Role) -> None:
    drive = Drive(role)
    lines = [line for page in drive.run(20.0) for line in re.findall(r"^- .* away, (.*)$", page, re.MULTILINE)]
    assert {"ahead", "behind"} <= set(lines) <= {"ahead", "behind", "to the left", "to the right"}


def test_driver_is_shown_the_looks_of_what_is_in_view_and_the_passenger_of_all() -> None:
    for role, title in ((Role.PARTICIPANT, "Looks:"), (Role.CO_WIZARD, "Looks of what is in view:")):
        page = Drive(role).page()
        places = dict(re.findall(r"^- (.*), on .* (\d+) m away as the crow", page, re.MULTILINE))
        kinds = {label for label in places if label.startswith(("House", "Person"))}
        near = {label for label in kinds if role is Role.PARTICIPANT or int(places[label]) < IN_VIEW}
        looks = dict(line.partition(": ")[::2] for line in listed(page, title))
        assert set(looks) == near and all(looks.values())
        assert kinds


def with_barrier(drive: Drive, ahead: float) -> ObservationMapping:
    """The observation with a barrier on the lane of the car."""
    seen = drive.seen()
    lane, station = int(seen["lane"]), float(seen["station"][0])
    x, y = drive.engine.town.lanes[lane].position(station + ahead)
    kind = PropKind.STREET_BARRIER
    objects = np.zeros_like(seen["objects"])
    objects[0] = (ObjectClass.STATIC.value, x, y, ahead, 0.0, kind.length, kind.width, 0.0)
    return {**seen, "objects": objects}


def test_way_of_the_participant_leads_around_an_obstacle_in_sight() -> None:
    drive = Drive(Role.PARTICIPANT, 8)
    first = drive.page()
    place = re.findall(r"^- (.*), on .* m away as the crow", first, re.MULTILINE)[0]
    drive.answer(guide=place)
    before = drive.page()
    drive.state = drive.turns.attend(with_barrier(drive, 8.0), drive.state)
    after = drive.page()
    assert re.search(r"The way is blocked, 8 m from here: street barrier. The way there now leads around", after)
    ways = [int(re.search(r"Way there: (\d+) m", page)[1]) for page in (before, after)]  # type: ignore[index]
    assert ways[1] != ways[0]


def test_choice_that_came_too_late_is_told_once() -> None:
    drive = Drive(Role.CO_WIZARD)
    drive.page()
    drive.answer(drive="JTurn 179")
    assert 'What you chose, "JTurn 179", was no longer possible' in drive.page()
    drive.answer()
    drive.step()
    assert "no longer possible" not in drive.page()
