"""A new weather parameter: set by the Ad-Wizard, observed, recorded and remarked on."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changes.working_copy import Edit, WorkingCopy, follow, listed_files

EDITS = (
    Edit(
        "dorothie_gym/ontology/world_exceptions.py",
        '    WETNESS = "wetness", 0.0, 100.0, 0.0, "%"\n',
        '    WETNESS = "wetness", 0.0, 100.0, 0.0, "%"\n    DUST_STORM = "dust_storm", 0.0, 100.0, 0.0, "%"\n',
    ),
    Edit(
        "dorothie_gym/dialogue/data/talk/36_surroundings.talk",
        "== Explain topic=much_wetness\n",
        "== Explain topic=much_dust_storm\nthere's dust in the air\n"
        "== Explain topic=less_dust_storm\nthe dust has settled\n"
        "== Explain topic=much_wetness\n",
        r"dorothie_gym/dialogue/data/talk: there is no section `== Explain topic=much_dust_storm`",
    ),
    Edit(
        "dorothie_gym/policies/notable_conditions.py",
        "        W.WETNESS: lambda now: now[W.WETNESS] / 45.0,\n",
        "        W.WETNESS: lambda now: now[W.WETNESS] / 45.0,\n"
        "        W.DUST_STORM: lambda now: now[W.DUST_STORM] / 40.0,\n",
        r"CONSPICUOUS of dorothie_gym/policies/notable_conditions\.py .* WeatherParameter\.DUST_STORM",
    ),
    Edit(
        "dorothie_gym/policies/ad_wizard.py",
        "        WeatherParameter.WETNESS: (1.0, (0.5, 1.0)),\n",
        "        WeatherParameter.WETNESS: (1.0, (0.5, 1.0)),\n"
        "        WeatherParameter.DUST_STORM: (1.0, (0.5, 1.0)),\n",
        r"WEATHERS of dorothie_gym/policies/ad_wizard\.py .* WeatherParameter\.DUST_STORM",
    ),
    Edit(
        "dorothie_gym/sim/weather.py",
        "            fog=fog_extinction(",
        "            fog=0.05 * self.above_clear(WeatherParameter.DUST_STORM)\n            + fog_extinction(",
        r"AssertionError: dust dims nothing",
    ),
)

PROBE = """
import tempfile
from pathlib import Path
from dorothie_gym.dialogue.grammar import load_grammar
load_grammar()
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind, WeatherParameter
from dorothie_gym.policies.policy_loader import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import AdWizardAction

engine = SessionEngine("brookside", config=EnvConfig(max_seconds=10.0, word_error_rate=0.0))
scripted = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
with tempfile.TemporaryDirectory() as folder:
    play_session(engine, scripted, seed=1, folder=Path(folder) / "session")
    assert "dust_storm" in Session.load(Path(folder) / "session").scene.weather.rows.dtype.names

engine.reset(seed=1)
clear = engine.session.world.sight
dust = AdWizardAction(exception=ExceptionKind.WEATHER, weather=WeatherParameter.DUST_STORM, share=0.8)
actions = {str(role): policy.step(engine.observations[str(role)], policy.initial_state(1, engine.town))[0]
           for role, policy in scripted.items()}
engine.step({**actions, "ad_wizard": dust.encode(engine.limits)})
assert not engine.session.log.refused[Role.AD_WIZARD]
assert engine.observations["participant"]["weather"][-1] == 80.0
assert engine.session.world.sight < 0.9 * clear, "dust dims nothing"
"""


@pytest.mark.slow
def test_following_the_page_adds_a_weather_parameter(tmp_path: Path) -> None:
    follow(WorkingCopy(tmp_path), EDITS, PROBE)


def test_page_lists_the_files_for_a_weather_parameter() -> None:
    assert [edit.file for edit in EDITS] == listed_files("A weather parameter")[:5]


def test_first_error_names_the_words_of_a_weather_parameter(tmp_path: Path) -> None:
    copy = WorkingCopy(tmp_path)
    copy.edit(EDITS[0])
    error = copy.first_error("from dorothie_gym.dialogue.grammar import load_grammar; load_grammar()")
    assert "dorothie_gym/dialogue/data/talk: there is no section `== Explain topic=much_dust_storm`" in error
