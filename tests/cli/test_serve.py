"""`dorothie-gym serve`: mistakes. Sessions over the server are tested in `tests/agents/test_openenv.py`."""

from __future__ import annotations

from importlib.util import find_spec

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.support.installation import pip_install


@pytest.mark.skipif(find_spec("openenv") is not None, reason="the extra is installed")
def test_missing_extra_is_named() -> None:
    result = CliRunner().invoke(app, ["serve", "openenv"])
    assert result.exit_code == 2
    assert f"needs openenv, which is not installed; run: {pip_install('openenv')}" in result.stderr


@pytest.mark.parametrize(("arguments", "words"), [(["gym"], "'gym' is not"), (["openenv", "--port", "70000"], "65535")])
def test_wrong_options_are_refused(arguments: list[str], words: str) -> None:
    result = CliRunner().invoke(app, ["serve", *arguments])
    assert result.exit_code == 2 and words in result.stderr
