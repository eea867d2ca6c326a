"""A new metric of rollouts: in their file and table, and on the leaderboard."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changes.working_copy import Edit, WorkingCopy, follow, listed_files

METRICS = "dorothie_gym/evaluation/closed_loop/metrics.py"

EDITS = (
    Edit(
        METRICS,
        "    ExceptionsRecovered(),\n)\n",
        "    ExceptionsRecovered(),\n    Utterances(),\n)\n",
        r"KeyError: 'utterances'",
    ),
    Edit(
        METRICS,
        "METRICS: Final[tuple",
        "@dataclass(frozen=True, kw_only=True)\n"
        "class Utterances(ClosedLoopMetric):\n"
        '    """Number of utterances of a session."""\n\n'
        '    key: ClassVar[str] = "utterances"\n'
        '    title: ClassVar[str] = "utterances"\n'
        "    is_share: ClassVar[bool] = False\n\n"
        "    def parts(self, record: SessionRecord) -> tuple[float, float]:\n"
        '        """Returns the numerator (the number of utterances) and the denominator (1) of the metric."""\n'
        "        return float(record.talk.utterances), 1.0\n\n\n"
        "METRICS: Final[tuple",
        r"NameError: name 'Utterances'",
    ),
    Edit(
        "dorothie_gym/evaluation/closed_loop/leaderboard.py",
        '"exceptions_recovered", "recovery_seconds",\n',
        '"exceptions_recovered", "recovery_seconds", "utterances",\n',
        r"AssertionError: not on the page",
    ),
)

PROBE = """
from pathlib import Path
from dorothie_gym.evaluation.closed_loop.leaderboard import leaderboard_page, read_entries
from dorothie_gym.evaluation.closed_loop.running import RolloutSettings, roll_out
from dorothie_gym.session.config import EnvConfig

folder = Path("rollout")
result = roll_out(RolloutSettings(sessions=2, towns=("brookside",), config=EnvConfig(max_seconds=20.0)), folder)
talk = [row.record.talk.utterances for row in result.rows]
assert result.table().figures["utterances"]["mean"] == sum(talk) / 2
assert "| utterances |" in leaderboard_page(read_entries([folder])), "not on the page"
"""


@pytest.mark.slow
def test_following_the_page_adds_a_metric(tmp_path: Path) -> None:
    follow(WorkingCopy(tmp_path), EDITS, PROBE)


def test_page_lists_the_file_for_a_metric() -> None:
    files = listed_files("A metric of rollouts")
    assert files[0] == METRICS and EDITS[-1].file in files
