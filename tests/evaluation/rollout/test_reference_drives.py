from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.errors import InputFileError
from dorothie_gym.evaluation.closed_loop import RolloutSettings, roll_out
from dorothie_gym.evaluation.rollout import reference_drives
from dorothie_gym.evaluation.rollout.reference_drives import drive_key, read_drives, reference_of, write_drives
from dorothie_gym.maps import load_town
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.scenario import ReferenceDrive, draw_scenario

DRIVE = ReferenceDrive(seconds=123.5, exchanges=7, subgoals=3)


def test_files_are_read_back_and_equal_drives_give_equal_bytes(tmp_path: Path) -> None:
    drives = {"b/x/1": DRIVE, "a/y/2": ReferenceDrive(seconds=9.0, exchanges=0, subgoals=2)}
    write_drives(tmp_path / "one.json", drives)
    write_drives(tmp_path / "two.json", dict(reversed(drives.items())))
    assert read_drives(tmp_path / "one.json") == drives
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "drives.json"
    file.write_text('{"version": "1", "drives": {"a": {"seconds": "long"}}}', encoding="utf-8")
    with pytest.raises(InputFileError, match=r"drives\.json"):
        read_drives(file)


def test_stored_references_are_not_measured_again(monkeypatch: pytest.MonkeyPatch) -> None:
    town = load_town("brookside")
    scenario = draw_scenario(town, None, 11)
    monkeypatch.setattr(reference_drives, "stored_drives", lambda: {drive_key(scenario, "brookside"): DRIVE})
    assert reference_of(town, scenario) == DRIVE


def test_sessions_of_a_rollout_have_the_known_reference_of_their_scenario(tmp_path: Path) -> None:
    settings = RolloutSettings(
        towns=("brookside",),
        sessions=2,
        trials=2,
        references=True,
        config=EnvConfig(time_factor=0.1, observe_acts=False),
    )
    town = load_town("brookside")
    known = {drive_key(draw_scenario(town, None, plan.seed), town.name): DRIVE for plan in settings.plans()}
    result = roll_out(settings, tmp_path, drives=known)
    first, second = [row.record for row in result.rows]
    assert first is not None and second is not None
    assert first.reference == DRIVE and first.seconds == 12.0 and first.infractions == {"timeout": 1}
    assert [row.seed for row in result.rows] == [result.rows[0].seed] * 2 and result.rows[1].trial == 1


@pytest.mark.long
def test_the_reference_pair_drives_a_scenario_and_is_measured_equally_again() -> None:
    town = load_town("brookside")
    scenario = draw_scenario(town, None, 5)
    found = reference_drives.measure_drive(town, scenario)
    assert found.seconds > 60.0 and found.exchanges > 0
    assert reference_drives.measure_drive(town, scenario) == found
