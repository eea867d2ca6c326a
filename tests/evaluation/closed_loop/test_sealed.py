"""Sealed tests: the seal of a model, the rollout after the beacon, its submission, and its row on the board."""

from __future__ import annotations

import datetime
import json
import re
import shlex
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.errors import RolloutError
from dorothie_gym.evaluation.closed_loop import (
    Beacon,
    RolloutSettings,
    command_of,
    leaderboard_page,
    read_entries,
    read_result,
    read_seal,
    roll_out,
    seal_of,
    write_seal,
)
from dorothie_gym.evaluation.closed_loop.protocol import LeaderboardProtocol
from dorothie_gym.evaluation.closed_loop.submission import check_submission
from dorothie_gym.evaluation.rollout import read_drives, write_drives
from dorothie_gym.evaluation.tiers import EARS, TIERS
from dorothie_gym.ontology import Role
from dorothie_gym.policies import find_player
from dorothie_gym.policies.language_model.config import LanguageModelConfig
from dorothie_gym.session.recording import Session
from tests.evaluation.closed_loop.rollout_edits import edit, edit_settings, sessions_of

BEFORE = datetime.date(2026, 11, 30)
BEACON = Beacon(text="pulse 1B7E", date="2026-12-01")
PROTOCOL = LeaderboardProtocol(sessions=2)
TALK = {"tier": "ask-first", "beacon": BEACON.to_json()}


def settings_of(co_wizard: str = "keyword-rule", protocol: LeaderboardProtocol = PROTOCOL, **page: Any) -> Any:
    """Settings of the protocol for a rollout in a tier, with a Co-Wizard."""
    wanted = protocol.settings({**TALK, **page})
    return replace(wanted, cast={**wanted.cast, Role.CO_WIZARD: find_player(co_wizard, Role.CO_WIZARD)})


def sealed(settings: RolloutSettings, date: datetime.date = BEFORE) -> RolloutSettings:
    return replace(settings, seal=seal_of(settings.to_json(), date))


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sealed") / "honest"
    roll_out(sealed(settings_of()), folder)
    return folder


@pytest.fixture
def copy(honest: Path, tmp_path: Path) -> Path:
    shutil.copytree(honest, tmp_path / "rollout")
    return tmp_path / "rollout"


# --- Submission -------------------------------------------------------------------------------------------------------


def test_a_sealed_rollout_is_played_again_and_submitted(honest: Path) -> None:
    found = check_submission(honest, protocol=PROTOCOL)
    assert found.faults == () and found.resimulated == (0, 1) and found.played
    assert "dates of seal and beacon" in found.claims
    page: Any = json.loads(json.dumps(found.submission))
    assert page["part"] == "sealed ask-first"
    assert page["settings"]["beacon"] == {"text": "pulse 1B7E", "date": "2026-12-01"}
    assert page["settings"]["seal"]["date"] == "2026-11-30"


def test_the_command_names_the_beacon_and_the_file_of_the_seal(honest: Path) -> None:
    words = shlex.split(command_of(read_result(honest).settings, "my seal.json"))
    assert words[words.index("--seal") + 1] == "my seal.json"
    assert "--beacon" in words and "--seed" not in words and "--towns" not in words


def test_the_header_of_each_session_has_the_beacon(honest: Path, copy: Path) -> None:
    for folder in sessions_of(honest):
        assert Session.load(folder).header.extra["beacon"] == BEACON.to_json()
    (folder, *_) = sessions_of(copy)
    edit(folder / "session.json", lambda page: page["beacon"].update(text="another"))
    assert "header is not what its seed gives" in str(check_submission(copy, protocol=PROTOCOL).faults)


@pytest.mark.parametrize("days", [0, 1, 400])
def test_a_model_that_was_sealed_too_late_is_refused(copy: Path, days: int) -> None:
    late = datetime.date(2026, 12, 1) + datetime.timedelta(days=days)
    with pytest.raises(ValueError, match="sealed on an earlier day"):
        sealed(settings_of(), late)
    page = seal_of(settings_of().to_json(), late).to_json()
    edit_settings(copy, lambda settings: settings.update(seal=page))
    (fault,) = check_submission(copy, protocol=PROTOCOL).faults
    assert f"sealed on {late}" in fault and "beacon became known on 2026-12-01" in fault


def test_a_seal_that_was_changed_is_refused(copy: Path) -> None:
    edit_settings(copy, lambda settings: settings["seal"].update(date="2026-01-01"))
    (fault,) = check_submission(copy, protocol=PROTOCOL).faults
    assert "changed after the model was sealed" in fault


def test_an_invented_infraction_is_found(copy: Path) -> None:
    invented = {"kind": "red_light", "seconds": 1.0, "own_fault": True}
    edit(copy / "rollout.json", lambda page: page["rows"][0]["record"].update(infraction_events=[invented]))
    assert "infraction_events is" in str(check_submission(copy, protocol=PROTOCOL).faults)


def test_beacon_and_seal_need_each_other(copy: Path) -> None:
    edit_settings(copy, lambda settings: settings.pop("seal"))
    assert "nothing shows that the model was finished before" in str(check_submission(copy, protocol=PROTOCOL).faults)
    with pytest.raises(ValueError, match="without a beacon"):
        RolloutSettings(seal=seal_of(settings_of().to_json(), BEFORE))


def test_scenarios_of_another_beacon_are_refused(copy: Path) -> None:
    edit_settings(copy, lambda settings: settings["beacon"].update(text="an easier one"))
    faults = " ".join(check_submission(copy, protocol=PROTOCOL).faults)
    assert "seed is" in faults and "towns are" in faults


def test_a_rollout_in_a_tier_is_submitted_without_a_seal(tmp_path: Path) -> None:
    roll_out(settings_of(beacon=None), tmp_path / "tier")
    found = check_submission(tmp_path / "tier", protocol=PROTOCOL)
    assert found.faults == () and found.submission is not None and found.submission["part"] == "ask-first"
    edit_settings(tmp_path / "tier", lambda page: page.update(ad_wizard="silent"))
    assert "ad_wizard is silent" in str(check_submission(tmp_path / "tier", protocol=PROTOCOL).faults)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"tier": "tough"}, "the tiers are standard"),
        ({"trials": 2}, "a submission has 1 or 3"),
        ({"oracle": True}, "the oracle of the tier is talk-oracle"),
        ({"references": True}, "references is True"),
        ({"pool_sha256": ["0" * 64]}, "pool_sha256 is"),
    ],
)
def test_settings_that_are_not_those_of_the_tier_are_refused(
    copy: Path, change: dict[str, object], message: str
) -> None:
    edit_settings(copy, lambda settings: settings.update(change))
    assert message in " ".join(check_submission(copy, protocol=PROTOCOL).faults)


@pytest.mark.long
def test_references_trials_and_partners_of_a_tier_are_played_again(tmp_path: Path) -> None:
    short = replace(EARS, config=replace(EARS.config, time_factor=0.1))
    protocol = LeaderboardProtocol(sessions=6, tiers={**TIERS, "ears": short})
    roll_out(settings_of("lane-follow", protocol, tier="ears", trials=3, beacon=None), tmp_path / "ears")
    assert check_submission(tmp_path / "ears", protocol=protocol).faults == ()
    folder = tmp_path / "ears"
    first = sessions_of(folder)[0]
    edit(first / "session.json", lambda page: page["reference"].update(seconds=1e4))
    assert "its header is not what its seed gives" in str(check_submission(folder, protocol=protocol).faults)
    edit(folder / "rollout.json", lambda page: page["rows"][0].update(participant="scripted"))
    assert "its row has the participant 'scripted'" in str(check_submission(folder, protocol=protocol).faults)


# --- Seals ------------------------------------------------------------------------------------------------------------


def test_a_seal_survives_its_file(tmp_path: Path) -> None:
    made = seal_of(settings_of().to_json(), BEFORE)
    write_seal(tmp_path / "seal.json", made)
    assert read_seal(tmp_path / "seal.json") == made
    assert made.date == "2026-11-30" and re.fullmatch("[0-9a-f]{64}", made.code_sha256)
    edit(tmp_path / "seal.json", lambda page: page.update(policy_sha256="0" * 64))
    with pytest.raises(RolloutError, match="does not have its own hash"):
        read_seal(tmp_path / "seal.json")
    with pytest.raises(RolloutError, match="dorothie-gym seal MODEL"):
        read_seal(tmp_path / "none.json")


@pytest.mark.parametrize("other", ["always-asks", "scripted", "scripted:certainty=0.3"])
def test_another_policy_is_refused(other: str) -> None:
    seal = seal_of(settings_of().to_json(), BEFORE)
    with pytest.raises(ValueError, match="not the model that was sealed"):
        replace(settings_of(other), seal=seal)


def test_weights_are_known_by_their_hash_and_not_by_their_path() -> None:
    player = find_player("keyword-rule", Role.CO_WIZARD)
    settings = settings_of()

    def playing(name: str, sha256: str) -> RolloutSettings:
        model = replace(player, name=name, sha256=sha256)
        return replace(settings, cast={**settings.cast, Role.CO_WIZARD: model})

    seal = seal_of(playing("runs/a", "a" * 64).to_json(), BEFORE)
    assert seal.policy_sha256 == "a" * 64
    assert replace(playing("elsewhere/a", "a" * 64), seal=seal)
    with pytest.raises(ValueError, match="not the model that was sealed"):
        replace(playing("runs/a", "b" * 64), seal=seal)


def test_a_class_is_known_by_its_name_and_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = "from dorothie_gym.policies import LaneFollowPolicy\n\nclass One(LaneFollowPolicy): pass\n"
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "sealed_driver.py").write_text(source + "class Two(LaneFollowPolicy): pass\n")
    seals = {name: seal_of(settings_of(f"sealed_driver:{name}").to_json(), BEFORE) for name in ("One", "Two")}
    assert seals["One"].policy_sha256 != seals["Two"].policy_sha256
    assert replace(settings_of("sealed_driver:One"), seal=seals["One"])
    (tmp_path / "sealed_driver.py").write_text(source + "class Two(LaneFollowPolicy): x = 1\n")
    with pytest.raises(ValueError, match="not the model that was sealed"):
        replace(settings_of("sealed_driver:One"), seal=seals["One"])
    sys.modules.pop("sealed_driver")


def test_a_language_model_is_known_by_name_and_settings_without_its_address() -> None:
    def playing(**changes: Any) -> RolloutSettings:
        config = LanguageModelConfig(**{"model": "large", "url": "http://localhost/v1", **changes})
        player = find_player("llm:large", Role.CO_WIZARD, config)
        settings = settings_of()
        return replace(settings, cast={**settings.cast, Role.CO_WIZARD: player})

    seal = seal_of(playing().to_json(), BEFORE)
    assert replace(playing(url="http://127.0.0.1/v1"), seal=seal)
    with pytest.raises(ValueError, match="not the model that was sealed"):
        replace(playing(max_tokens=17), seal=seal)


def test_other_code_and_other_settings_are_refused() -> None:
    settings = settings_of()
    seal = seal_of(settings.to_json(), BEFORE)
    for changed, message in (
        (replace(seal, code_sha256="0" * 64), "install the version that was sealed"),
        (replace(seal, run={**seal.run, "tier": "admit-it"}), "tier is 'ask-first'; the seal has 'admit-it'"),
        (replace(seal, run={**seal.run, "sessions_planned": 100}), "sessions_planned is 2"),
    ):
        with pytest.raises(ValueError, match=message):
            replace(settings, seal=changed)


# --- Board and commands -----------------------------------------------------------------------------------------------


def test_sealed_rows_are_a_part_of_their_own(honest: Path, tmp_path: Path) -> None:
    shutil.copytree(honest, tmp_path / "sealed")
    roll_out(settings_of(), tmp_path / "unsealed")
    roll_out(settings_of("talk-oracle", oracle=True), tmp_path / "oracle")
    entries = read_entries([tmp_path])
    assert {(entry.part, entry.policy) for entry in entries} == {
        ("ask-first", "keyword-rule (beacon pulse 1B7E of 2026-12-01)"),
        ("sealed ask-first", "keyword-rule (beacon pulse 1B7E of 2026-12-01)"),
        ("sealed ask-first", "talk-oracle (oracle, beacon pulse 1B7E of 2026-12-01)"),
    }
    page = leaderboard_page(entries)
    assert page.index("## Tier ask-first\n") < page.index("## Tier ask-first, sealed before the test")
    command = "--beacon 'pulse 1B7E' --beacon-date 2026-12-01 --seal FILE --sessions 2"
    assert command in page and "dates of seal and beacon" in page


def run(*arguments: object) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_from_the_seal_to_the_board(tmp_path: Path) -> None:
    seal, out = tmp_path / "seal.json", tmp_path / "run"
    done = run("seal", "keyword-rule", "--tier", "ask-first", "--sessions", "1", "--out", seal)
    assert done.exit_code == 0, done.output
    assert read_seal(seal).to_json()["sha256"] in done.stdout
    assert "a seal is not replaced" in run("seal", "keyword-rule", "--out", seal).stderr
    tomorrow = datetime.datetime.now(datetime.UTC).date() + datetime.timedelta(days=1)
    beacon = ("--beacon", "pulse 7", "--beacon-date", tomorrow, "--sessions", "1", "--workers", "1")
    same = ("rollout", "--tier", "ask-first", *beacon, "--seal", seal)
    assert "not the model that was sealed" in run(*same, "--co-wizard", "says-yes").stderr
    today = tomorrow - datetime.timedelta(days=1)
    late = run(*same, "--co-wizard", "keyword-rule", "--beacon-date", today)
    assert late.exit_code == 2 and "sealed on an earlier day" in late.stderr
    done = run(*same, "--co-wizard", "keyword-rule", "--out", out)
    assert done.exit_code == 0, done.output
    done = run("leaderboard", out, "--out", tmp_path / "board.md")
    assert "## Tier ask-first, sealed before the test" in (tmp_path / "board.md").read_text(), done.output


@pytest.mark.long
def test_references_of_a_beacon_are_measured_by_a_command_and_read(tmp_path: Path) -> None:
    file, beacon = tmp_path / "references.json", ("--beacon", "pulse 7", "--beacon-date", "2026-12-01")
    common = ("--tier", "rough", *beacon, "--sessions", "1", "--workers", "1")
    done = run("reference-times", *common, "--out", file)
    assert done.exit_code == 0, done.output
    ((key, drive),) = read_drives(file).items()
    town, _, seed = key.split("/")
    drawn = Beacon(text="pulse 7", date="2026-12-01")
    (plan,) = RolloutSettings(sessions=1, towns=drawn.towns, seed=drawn.seed).plans()
    assert (town, int(seed)) == (plan.town, plan.seed)
    write_drives(file, {key: replace(drive, seconds=5.0)})
    options = ("--co-wizard", "lane-follow", "--participant", "scripted", "--references", file)
    done = run("rollout", *common, *options, "--out", tmp_path / "run")
    assert done.exit_code == 0, done.output
    (row,) = read_result(tmp_path / "run").rows
    assert row.record is not None and row.record.reference is not None and row.record.reference.seconds == 5.0
    assert "cannot be read" in run("rollout", *common, "--references", tmp_path / "none.json").stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--beacon", "x", "--beacon-date", "2026-12-01"), "give it with --tier"),
        (("--tier", "rough", "--beacon", "x"), "needs --beacon-date"),
        (("--tier", "rough", "--beacon-date", "2026-12-01"), "give its text with --beacon"),
        (("--tier", "rough", "--beacon", "x", "--beacon-date", "soon"), "YYYY-MM-DD"),
        (("--tier", "rough", "--beacon", "x", "--beacon-date", "2026-12-01", "--seed", "0"), "leave out --seed"),
        (("--tier", "rough", "--beacon", "x", "--beacon-date", "2026-12-01", "--towns", "all"), "leave out --towns"),
        (("--tier", "rough", "--seal", "seal.json"), "with --beacon"),
        (("--tier", "rough", "--seal", "none.json", "--beacon", "x", "--beacon-date", "2026-12-01"), "does not exist"),
    ],
)
def test_options_of_a_sealed_test_that_do_not_belong_together_are_refused(
    arguments: tuple[str, ...], message: str
) -> None:
    done = run("rollout", *arguments)
    assert done.exit_code == 2 and message in done.stderr, done.output
