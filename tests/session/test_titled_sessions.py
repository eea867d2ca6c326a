"""Sessions in a town whose map names its streets: people see, hear and type these names; the record keeps its own."""

from __future__ import annotations

import re

import pytest

from dorothie_gym.agents import TextSession
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.analysis.transcript import transcript_lines
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import Town, load_town
from dorothie_gym.ontology import AGENT_ROLES, Role, StreetName
from dorothie_gym.pictures.views.playback import Playback
from dorothie_gym.pictures.views.session_scene import scene_of
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session
from dorothie_gym.session.recording.street_titles import STREET_TITLES, recorded_labels, recorded_titles
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.session.session_engine import SessionEngine
from tests.lab.console.people import Table
from tests.maps.titled_towns import TITLES, titled

NAMES = re.compile("|".join(name.label for name in StreetName if name.value not in (0, 15, 16)))
SECONDS = 120.0


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> Town:
    return titled(tmp_path_factory.mktemp("titled"))


@pytest.fixture(scope="module")
def engine(town: Town) -> SessionEngine:
    return SessionEngine(town, config=EnvConfig(max_seconds=SECONDS))


@pytest.fixture(scope="module")
def session(engine: SessionEngine, tmp_path_factory: pytest.TempPathFactory) -> Session:
    folder = tmp_path_factory.mktemp("played") / "one"
    play_session(
        engine, {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}, seed=5, folder=folder
    )
    return Session.load(folder)


def test_scenario_names_all_titled_streets_and_keeps_names_of_the_vocabulary(town: Town) -> None:
    for seed in range(5):
        scenario = draw_scenario(town, None, seed)
        names = dict(zip(scenario.street_titles, scenario.street_names, strict=True))
        assert names["N Broadway"] is StreetName.BROADWAY
        assert StreetName.UNKNOWN not in names.values() and len(set(names.values())) == len(names)
        assert scenario.street_labels == list(town.street_titles)
    assert draw_scenario(load_town("brookside"), None, 0).street_titles == ()


def test_transcripts_and_scenes_have_the_names_of_the_map(session: Session, engine: SessionEngine, town: Town) -> None:
    said = [line.text for line in transcript_lines(session) if line.said]
    assert any(title in text for text in said for title in TITLES)
    assert not [text for text in said if NAMES.search(text.replace("N Broadway", ""))]
    assert any(NAMES.search(utterance.text) for utterance in session.utterances())  # the record keeps the vocabulary
    assert session.header.extra[STREET_TITLES] == list(town.street_titles)
    for scene in (scene_of(engine.session), Playback(session, town).scene(3000)):
        assert scene.street_names == list(town.street_titles)
        texts = [f"{line.text} {line.acts}" for line in scene.utterances]
        assert texts and not [text for text in texts if NAMES.search(text.replace("N Broadway", ""))]


@pytest.mark.parametrize("titles", [3, ["a", 5], ["x" * 1000]])
def test_damaged_titles_are_refused(session: Session, titles: object) -> None:
    damaged = session.header.__class__.from_json({**session.header.to_json(), STREET_TITLES: titles})
    with pytest.raises(SessionError, match=STREET_TITLES):
        recorded_titles(damaged)
    with pytest.raises(SessionError, match=STREET_TITLES):
        recorded_labels(damaged)


def test_console_shows_and_reads_the_names_of_the_map(town: Town) -> None:
    table = Table("co_wizard=human,participant=human,ad_wizard=silent", town=town)
    passenger, driver = table.seat("participant"), table.seat("co_wizard")
    table.run(2.0)
    assert passenger.hello["streets"] == list(town.street_titles)
    names = {title: name for name, title in passenger.hello["titles"].items()}
    passenger.send("parse", c=1.0, text="turn left onto main street")
    table.run(0.2)
    (answer,) = [answer for answer in passenger.answers if answer["k"] == "parsed"]
    assert answer["spans"][0]["slots"]["Street"] == [names["Main St"]]
    assert answer["spans"][0]["text"] == "turn left onto Main St"
    passenger.command("say", text="turn left onto main street")
    table.until(lambda: driver.said(), 20.0)
    assert driver.said() == ["turn left onto Main St"]
    assert passenger.said() == ["turn left onto Main St"]
    (utterance,) = table.room.engine.session.dialogue.said
    assert utterance.text == f"turn left onto {names['Main St']}"


def test_pages_for_language_models_have_the_names_of_the_map(town: Town) -> None:
    session = TextSession(Role.CO_WIZARD, town, config=EnvConfig(max_seconds=60.0))
    turn = session.reset(4)
    assert any(title in turn.page for title in TITLES)
    assert not NAMES.search(turn.page.replace("N Broadway", ""))
    fields = turn.schema["properties"]
    marks = [
        (name, label) for name, field in fields.items() for label in field.get("enum", ()) if "on Main St" in label
    ]
    assert marks
    assert not [
        label
        for field in fields.values()
        for label in field.get("enum", ())
        if NAMES.search(label.replace("N Broadway", ""))
    ]
    turn = session.answer({marks[0][0]: marks[0][1], "say": "Is it on Main Street?"})
    assert not turn.error
    said = session.engine.scenario.titles
    assert any(said.shown(each.text).startswith("Is it on Main St") for each in _spoken(session))


def _spoken(session: TextSession) -> list[object]:
    dialogue = session.engine.session.dialogue
    return [*dialogue.said, *dialogue.in_progress]
