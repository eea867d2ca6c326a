"""Participant and Ad-Wizard by prompts, pictures in prompts, and the time of calls."""

from __future__ import annotations

import base64
import io
from dataclasses import replace

import numpy as np
from PIL import Image

from dorothie_gym.ontology import Role
from dorothie_gym.policies.language_model import LanguageModelConfig, SimulatedTime
from dorothie_gym.session.config import CameraConfig, EnvConfig
from dorothie_gym.session.recording import Event, EventType
from dorothie_gym.session.session_engine import SessionEngine
from tests.policies.language_model.fake_server import serving
from tests.policies.language_model.prompt_reader import CoWizardReader
from tests.policies.language_model.sessions import NOWHERE, PromptModel, play
from tests.policies.language_model.simple_readers import Interferer, guide


def test_participant_guides_the_scripted_car_to_its_places() -> None:
    reached = live = 0
    for seed in (0, 1):
        model = PromptModel(guide)
        summary = play({Role.PARTICIPANT: (NOWHERE, model)}, seed=seed)
        reached, live = reached + summary["subgoals"]["reached"], live + summary["subgoals"]["live"]
    assert reached >= live - 1


def test_ad_wizard_changes_world_and_task() -> None:
    kinds: set[str] = set()
    for seed in (2, 10):
        engines: list[SessionEngine] = []
        model = PromptModel(Interferer())
        summary = play({Role.AD_WIZARD: (NOWHERE, model)}, seed=seed, on_step=engines.append)
        kinds |= {str(data["kind"]) for _, _, data in engines[0].session.exceptions}
        assert summary["refusals"] <= 3
        assert "Mind the road." in [text for _, text in engines[0].session.messages]
    assert {"weather", "sensor_fault", "task_trigger", "spawn_vehicles"} <= kinds


def test_all_three_roles_can_ask_a_model() -> None:
    models = {
        Role.PARTICIPANT: (NOWHERE, PromptModel(guide)),
        Role.CO_WIZARD: (NOWHERE, PromptModel(CoWizardReader())),
        Role.AD_WIZARD: (NOWHERE, PromptModel(Interferer())),
    }
    summary = play(models, config=EnvConfig(max_seconds=120.0))
    assert set(summary["usage"]) == {"participant", "co_wizard", "ad_wizard"}
    assert all(usage["answers"] == usage["calls"] > 0 for usage in summary["usage"].values())
    assert summary["utterances"] >= 4


def test_prompt_contains_the_picture_that_the_role_observes() -> None:
    seen: list[np.ndarray] = []
    config = EnvConfig(max_seconds=5.0, camera=CameraConfig(width=96, height=64))
    with serving() as server:
        asks = LanguageModelConfig(model="m", url=server.url, pictures=True)
        play(
            {Role.CO_WIZARD: asks, Role.AD_WIZARD: replace(asks, model="blind")},
            config=config,
            on_step=lambda engine: seen.append(engine.observations["co_wizard"]["camera"].copy()),
        )
    first = next(request for request in server.requests if request["model"] == "m")
    text, picture = first["messages"][1]["content"]
    assert text["type"] == "text" and "You can drive" in text["text"]
    address = picture["image_url"]["url"]
    assert address.startswith("data:image/png;base64,")
    pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(address.partition(",")[2]))))
    assert np.array_equal(pixels, seen[0])
    blind = next(request for request in server.requests if request["model"] == "blind")
    assert isinstance(blind["messages"][1]["content"], str)  # the Ad-Wizard observes no picture


def test_answer_takes_effect_after_the_time_of_the_call_where_it_is_charged() -> None:
    def brake(prompt: str) -> dict[str, str]:
        return {"drive": "Stop" if "Stop" in prompt.rpartition("You can drive: ")[2].split(", ") else "none"}

    stopped: dict[SimulatedTime, float] = {}
    for time in SimulatedTime:
        events: list[Event] = []
        config = replace(NOWHERE, time=time)
        play(
            {Role.CO_WIZARD: (config, PromptModel(brake, latency=3.0))},
            config=EnvConfig(max_seconds=8.0),
            others="silent",
            on_step=lambda engine, events=events: events.extend(engine.last_events),
        )
        stopped[time] = next(event.time for event in events if event.type is EventType.PHYSICAL_ACTION)
    assert stopped[SimulatedTime.CHARGED] - stopped[SimulatedTime.WAITS] == 3.0
