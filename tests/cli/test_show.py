from __future__ import annotations

import io
from typing import Any

import pytest
from rich.console import Console

from dorothie_gym.cli.live import LiveShow, clock, script_lines
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Event, EventType

TASKS = ("Buy tea", "Go home")


def event(type_: EventType, source: Role, **data: Any) -> Event:
    return Event(frame=90, type=type_, source=source, data=data)


def said(utterance: int, text: str, move: str, **slots: list[str]) -> Event:
    data = {"utterance": utterance, "text": text, "span": text, "move": move, "slots": slots, "exchange": None}
    return event(EventType.DIALOGUE_MOVE, Role.CO_WIZARD, **data, start=0.0, end=1.0)


def texts(*events: Event) -> list[str]:
    return [line.text for line in script_lines(events, TASKS.__getitem__)]


def test_acts_of_an_utterance_are_below_its_words() -> None:
    words = "Okay. Which way?"
    events = [said(4, words, "Acknowledge"), said(4, words, "QueryW", Action=["Queried"]), said(5, "Right.", "Confirm")]
    first, second = script_lines(events, TASKS.__getitem__)
    assert (first.text, first.acts) == (words, "Acknowledge QueryW(Action=Queried)")
    assert first.time == 3.0 and first.speaker is Role.CO_WIZARD
    assert (second.text, second.acts) == ("Right.", "Confirm")


def test_reached_subgoals_are_green() -> None:
    done = event(EventType.SUBGOAL, Role.AGENT, subgoal=0, landmark="Coco", status="Complete", cause="arrival")
    (line,) = script_lines([done], TASKS.__getitem__)
    assert "Buy tea" in line.text and "green" in line.style
    gone = event(EventType.SUBGOAL, Role.AGENT, subgoal=1, landmark="House", status="Abandoned", cause="task_delete")
    assert texts(gone) == ["No longer: Go home"]


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ({"action": "JTurn", "angle": 88, "up": None}, "JTurn 88° left"),
        ({"action": "JTurn", "angle": -88, "up": None}, "JTurn 88° right"),
        ({"action": "JTurn", "angle": 0, "up": None}, "JTurn straight on"),
        ({"action": "SpeedChange", "angle": None, "up": True}, "SpeedChange up"),
        ({"action": "LightChange", "angle": None, "up": False}, "LightChange off"),
        ({"action": "Stop", "angle": None, "up": None}, "Stop"),
    ],
)
def test_physical_actions_are_shown(data: dict[str, Any], text: str) -> None:
    assert texts(event(EventType.PHYSICAL_ACTION, Role.CO_WIZARD, **data)) == [text]


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ({"kind": "weather", "parameter": "fog_density", "value": 60.0}, "weather: fog_density becomes 60"),
        ({"kind": "spawn_vehicles", "count": 3, "asked": 4}, "spawn vehicles: 3 appear"),
        ({"kind": "place_prop", "prop": "cone"}, "place prop: cone on the road"),
        ({"kind": "sensor_fault", "sensor": "gps", "on": True}, "sensor fault: gps begins"),
        ({"kind": "task_change", "subgoal": 1, "landmark": "Coco"}, "task change: Coco"),
    ],
)
def test_exceptions_are_shown(data: dict[str, Any], text: str) -> None:
    assert texts(event(EventType.EXCEPTION, Role.AD_WIZARD, **data)) == [text]


def test_hazards_collisions_and_messages_are_shown_and_beliefs_are_not() -> None:
    shown = texts(
        event(EventType.HAZARD_STOP, Role.AGENT, reason="Vehicles", distance=4.2),
        event(EventType.COLLISION, Role.AGENT, other="Vehicles", own_fault=False, speed=2.0),
        event(EventType.MESSAGE, Role.AD_WIZARD, text="It rains."),
        event(EventType.BELIEF_UPDATE, Role.CO_WIZARD, action="PlanUpdate", junctions=[1]),
    )
    assert shown == [
        "stops for a hazard 4 m ahead: Vehicles",
        "collides at 7 km/h: Vehicles (not its fault)",
        "“It rains.”",
    ]


@pytest.mark.parametrize("width", [40, 80, 200])
def test_every_event_fits_the_terminal(width: int) -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(max_seconds=30.0))
    policies = {role: make_policy("random", role, env.limits) for role in AGENT_ROLES}
    output = io.StringIO()
    with LiveShow(Console(file=output, width=width, color_system=None)) as show:
        play_session(env, policies, seed=1, on_step=show)
    lines = output.getvalue().splitlines()
    assert max(map(len, lines)) <= width
    assert any("Ad-Wizard" in line for line in lines)


def test_tasks_and_clock_are_below_the_dialogue() -> None:
    env = DuoWizardEnv("brookside", "poorly_cat", config=EnvConfig(max_seconds=3.0))
    policies = {role: make_policy("silent", role, env.limits) for role in AGENT_ROLES}
    output = io.StringIO()
    with LiveShow(Console(file=output, width=80, force_terminal=True, color_system=None)) as show:
        play_session(env, policies, seed=3, on_step=show)
    assert "0 of 3 tasks" in output.getvalue() and "x real time" in output.getvalue()


def test_clock_has_minutes_and_seconds() -> None:
    assert [clock(s) for s in (0, 9.9, 61, 600)] == ["0:00", "0:09", "1:01", "10:00"]
