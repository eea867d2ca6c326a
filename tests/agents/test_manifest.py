"""Manifest of the environment of OpenEnv, against the package; needs no OpenEnv."""

from __future__ import annotations

from importlib.resources import files
from inspect import signature
from typing import Any

import yaml

from dorothie_gym import __version__
from dorothie_gym.agents import openenv
from dorothie_gym.cli.serve import serve


def test_manifest_names_version_port_and_application() -> None:
    folder = files(openenv)
    manifest: dict[str, Any] = yaml.safe_load((folder / "openenv.yaml").read_text(encoding="utf-8"))
    module, _, name = manifest["app"].partition(":")
    assert manifest["version"] == __version__
    assert manifest["port"] == signature(serve).parameters["port"].default
    assert module == f"{openenv.__name__}.server" and f"\n{name} = " in (folder / "server.py").read_text("utf-8")
