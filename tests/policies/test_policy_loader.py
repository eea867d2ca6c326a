from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.errors import PolicyLoadError
from dorothie_gym.ontology import Role
from dorothie_gym.policies import (
    LaneFollowPolicy,
    Policy,
    SilentPolicy,
    find_player,
    loadable_kinds,
    policy_loader,
    register_loader,
)
from dorothie_gym.session.spaces import SpaceLimits

LIMITS = SpaceLimits()


def load_silent(path: Path, role: Role, limits: SpaceLimits) -> Policy[Any]:
    return SilentPolicy(role, limits)


@pytest.fixture(autouse=True)
def no_other_loaders(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(policy_loader, "_LOADERS", {})


def test_named_player_makes_its_policy() -> None:
    assert isinstance(find_player("lane-follow", Role.CO_WIZARD).make(Role.CO_WIZARD, LIMITS), LaneFollowPolicy)


def test_policy_of_another_role_raises_error_with_known_names() -> None:
    with pytest.raises(
        PolicyLoadError,
        match=r"there is no policy 'lane-follow'.*scripted, silent, random, client, pretrained:participant$",
    ):
        find_player("lane-follow", Role.PARTICIPANT)


@pytest.mark.parametrize("as_folder", [False, True])
def test_file_is_read_by_loader_of_its_kind(tmp_path: Path, as_folder: bool) -> None:
    register_loader("quiet", load_silent)
    (tmp_path / "model.json").write_text(json.dumps({"kind": "quiet"}))
    player = find_player(str(tmp_path if as_folder else tmp_path / "model.json"), Role.CO_WIZARD)
    assert isinstance(player.make(Role.CO_WIZARD, LIMITS), SilentPolicy)
    assert loadable_kinds() == ("benchmark", "co-wizard", "dorothie_gym-rl", "participant", "quiet")


def test_file_without_kind_is_read_by_suffix(tmp_path: Path) -> None:
    register_loader(".weights", load_silent)
    (tmp_path / "one.weights").write_bytes(b"1")
    (tmp_path / "two.weights").write_bytes(b"2")
    one, two = (find_player(str(tmp_path / f"{name}.weights"), Role.CO_WIZARD) for name in ("one", "two"))
    assert one.sha256 != two.sha256


def test_kind_with_line_breaks_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "model.json").write_text(json.dumps({"kind": "a\nb\r\nc"}))
    with pytest.raises(PolicyLoadError) as caught:
        find_player(str(tmp_path), Role.CO_WIZARD)
    assert len(str(caught.value).splitlines()) == 1


def test_kind_without_loader_raises_error(tmp_path: Path) -> None:
    (tmp_path / "model.json").write_text(json.dumps({"kind": "quiet"}))
    known = ", ".join(loadable_kinds())
    assert "quiet" not in known
    message = rf"of the kind 'quiet' or '.json', which cannot be played \(known: {known}\)"
    with pytest.raises(PolicyLoadError, match=message):
        find_player(str(tmp_path / "model.json"), Role.CO_WIZARD)
    register_loader(".weights", load_silent)
    with pytest.raises(PolicyLoadError, match=r"known: \.weights, benchmark"):
        find_player(str(tmp_path), Role.CO_WIZARD)


def test_folder_without_description_and_damaged_json_raise_error(tmp_path: Path) -> None:
    with pytest.raises(PolicyLoadError, match=r"folder without model.json"):
        find_player(str(tmp_path), Role.CO_WIZARD)
    (tmp_path / "model.json").write_text('{"kind": ')
    with pytest.raises(PolicyLoadError, match=r"model.json, column 10: not JSON"):
        find_player(str(tmp_path), Role.CO_WIZARD)


def test_second_loader_of_kind_raises_error() -> None:
    register_loader("quiet", load_silent)
    register_loader("quiet", load_silent)
    with pytest.raises(ValueError, match="have a loader already"):
        register_loader("quiet", lambda path, role, limits: SilentPolicy(role, limits))
    with pytest.raises(ValueError, match="have a loader already: dorothie_gym.baselines"):
        register_loader("benchmark", load_silent)
