from __future__ import annotations

from pathlib import Path

from click.testing import Result
from typer.testing import CliRunner

from dorothie_gym.cli import app
from tests.archive.sdn.builders import sample
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["show", *map(str, arguments)])


def test_sessions_of_any_layout_become_one_page(tmp_path: Path) -> None:
    ours, theirs = write(tmp_path / "ours", talk()), sample(tmp_path / "theirs")
    result = call(ours, theirs, "--out", tmp_path / "page.md")
    assert (result.exit_code, result.stdout) == (0, "")
    page = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert page.count("\n## ") + page.startswith("## ") == 2
    assert "To the KFC please. [Instruct(Landmark=KFC)]" in page and "Turn into Fuller." in page
    assert call(ours).stdout == page.split("\n## ")[0]


def test_invalid_arguments_are_reported_in_one_line(tmp_path: Path) -> None:
    for arguments, message in (
        ((tmp_path / "nowhere",), "nowhere"),
        ((write(tmp_path / "ours", talk()), "--out", tmp_path / "no" / "page.md"), "page.md"),
    ):
        result = call(*arguments)
        assert result.exit_code == 2 and message in result.stderr and result.stderr.count("\n") == 1
