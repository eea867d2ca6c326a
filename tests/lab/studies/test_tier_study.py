from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import pytest
import yaml

from dorothie_gym.errors import InputFileError
from dorothie_gym.evaluation.tiers import TIERS, Tier
from dorothie_gym.lab.console.config import ConsoleConfig
from dorothie_gym.lab.studies import check_sources, read_study
from dorothie_gym.lab.studies.tier_study import tier_study
from dorothie_gym.session.config import ChannelKind

EXAMPLE = (files("dorothie_gym.lab.studies") / "data" / "example.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("tier", TIERS.values(), ids=list(TIERS))
def test_example_of_a_tier_is_a_study_in_it(tmp_path: Path, tier: Tier) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(tier_study(EXAMPLE, tier), encoding="utf-8")
    study = read_study(file)
    check_sources(study, file)
    assert study.session.tier == tier.name
    assert [condition.participant for condition in study.conditions] == list(tier.participants)
    assert all(
        condition.co_wizard == "human" and condition.ad_wizard == tier.ad_wizard for condition in study.conditions
    )
    assert {scenario.town for scenario in study.scenarios} <= set(tier.towns)
    usual, of_tier = yaml.safe_load(EXAMPLE), yaml.safe_load(file.read_text(encoding="utf-8"))
    assert usual["consent"] == of_tier["consent"] and usual["questionnaires"] == of_tier["questionnaires"]
    assert usual["texts"].keys() == of_tier["texts"].keys()
    assert "half of the pairs" in usual["texts"]["debriefing"], "it names the conditions of the usual example"
    assert "half" not in study.texts.debriefing and "your passenger was a computer program" in study.texts.debriefing


def test_an_unknown_tier_is_refused_with_its_field(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(tier_study(EXAMPLE, TIERS["rough"]).replace("tier: rough", "tier: tough"), encoding="utf-8")
    with pytest.raises(InputFileError, match="session.tier.*tough"):
        check_sources(read_study(file), file)


def test_sessions_of_people_have_the_settings_of_the_tier() -> None:
    usual, rough = ConsoleConfig().environment(), ConsoleConfig(tier="rough").environment()
    assert rough.time_factor == 2.0 and rough.world == TIERS["rough"].config.world
    assert rough.decision_frequency == usual.decision_frequency
    assert ConsoleConfig(tier="rough", max_seconds=60.0).environment().time_factor is None
    assert ConsoleConfig(tier="strangers").environment().channel is ChannelKind.TEXT
