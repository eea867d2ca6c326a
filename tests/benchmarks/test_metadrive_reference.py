from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from benchmarks.metadrive_reference import metadrive_reference


def test_metadrive_without_assets_is_not_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "metadrive").mkdir()
    (tmp_path / "metadrive" / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.warns(UserWarning, match="pull_asset"):
        assert metadrive_reference(0) is None


@pytest.mark.skipif(find_spec("metadrive") is None, reason="MetaDrive is not installed")
def test_metadrive_takes_steps() -> None:
    reference = metadrive_reference(0)
    if reference is None:
        pytest.skip("the assets of MetaDrive are missing")
    for _ in range(20):
        reference.prepare()
        reference.step()
    reference.close()
