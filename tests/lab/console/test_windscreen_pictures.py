"""Pictures through the windscreen: those of the observation, for the seats that look."""

from __future__ import annotations

import io

from PIL import Image

from dorothie_gym.lab.console.config import ConsoleConfig
from dorothie_gym.lab.console.windscreen import Windscreen
from dorothie_gym.session.config import CameraConfig, EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from tests.lab.console.people import Table


def test_the_stream_shows_what_the_observation_holds() -> None:
    width, height = 160, 90
    engine = SessionEngine("brookside", config=EnvConfig(camera=CameraConfig(width=width, height=height)))
    engine.reset(seed=3)
    windscreen = Windscreen(ConsoleConfig(picture_size=(width, height), picture_quality=95))
    windscreen.prepare(engine.session)
    compressed = io.BytesIO()
    Image.fromarray(engine.observations["co_wizard"]["camera"]).save(compressed, format="JPEG", quality=95)
    assert windscreen.picture(engine.session) == compressed.getvalue()


def test_seats_get_the_pictures_that_they_ask_for() -> None:
    table = Table("co_wizard=human", pictures=True)
    windscreen = table.room.windscreen
    assert windscreen is not None
    windscreen.prepare(table.room.engine.session)
    co_wizard, participant, ad_wizard = map(table.seat, ("co_wizard", "participant", "ad_wizard"))
    table.run(0.2)
    co_wizard.send("view", rate=5)
    participant.send("view", rate=10)
    ad_wizard.send("view", rate=10)
    table.run(2.0)
    assert 9 <= len(co_wizard.pictures) <= 11
    assert 19 <= len(participant.pictures) <= 21
    assert not ad_wizard.pictures and not ad_wizard.hello["pictures"]
    co_wizard.send("view", rate=0)
    table.run(1.0)
    assert len(co_wizard.pictures) <= 11
