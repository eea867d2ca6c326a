"""File of the figures that README and docs state, each with the command and the commit that it was measured with."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.input_files import MAX_SMALL_JSON, checked, read_json

FILE: Final = Path(__file__).parents[2] / "docs" / "figures.json"

PERCENT: Final = "percent"
"""Format of a share with its interval, such as "65 % [49, 82]"."""

SHARE: Final = "share"
"""Format of a share without its interval, such as "65 %"."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """Measured value, with its confidence interval if it has one.

    Attributes:
        value: the value; shares are in [0, 1].
        low: lower end of the interval.
        high: upper end of the interval.
    """

    value: float
    low: float | None = None
    high: float | None = None

    def shown(self, layout: str = "") -> str:
        """Returns the figure as pages state it.

        Args:
            layout: `PERCENT`, `SHARE`, or a format of Python for the value.
        """
        if layout not in (PERCENT, SHARE):
            return format(int(self.value) if self.value == int(self.value) and not layout else self.value, layout)
        mean = f"{100 * self.value:.0f} %"
        if layout == SHARE or self.low is None or self.high is None:
            return mean
        return f"{mean} [{100 * self.low:.0f}, {100 * self.high:.0f}]"


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """Figures of one step, and how they were measured.

    Attributes:
        commands: commands that were run, in order.
        commit: commit of the checkout; two with ".." between if they were measured at several.
        build: hash of the package's folder in that commit (`git rev-parse COMMIT:dorothie_gym`): commits that change
            only pages and tests have the same. Empty if it was not recorded.
        date: date, ISO 8601.
        machine: processor and versions; empty if they were not recorded.
        figures: figures by name.
    """

    commands: tuple[str, ...]
    commit: str
    build: str = ""
    date: str
    machine: dict[str, Any] = field(default_factory=dict)
    figures: dict[str, Figure]


@dataclass(frozen=True, kw_only=True)
class FigureFile:
    """Content of the file.

    Attributes:
        format: version of the format.
        measurements: measurements by the name of their step.
    """

    format: Literal[1]
    measurements: dict[str, Measurement]


def load(path: Path = FILE) -> dict[str, Measurement]:
    """Returns the measurements of a file by the name of their step; raises `InputFileError` for a faulty file."""
    return checked(read_json(path, MAX_SMALL_JSON), FigureFile, path).measurements


def save(measurements: Mapping[str, Measurement], path: Path = FILE) -> None:
    """Writes measurements to a file, in the order of their names."""
    pages = {name: _page(measurements[name]) for name in sorted(measurements)}
    write_atomically(path, json.dumps({"format": 1, "measurements": pages}, indent=1, ensure_ascii=False) + "\n")


def _page(measurement: Measurement) -> dict[str, Any]:
    page = asdict(measurement)
    page["figures"] = {
        name: {key: value for key, value in asdict(figure).items() if value is not None}
        for name, figure in measurement.figures.items()
    }
    return page


def by_name(measurements: Mapping[str, Measurement]) -> dict[str, Figure]:
    """Returns all figures by "STEP.NAME"."""
    return {f"{step}.{name}": figure for step, found in measurements.items() for name, figure in found.figures.items()}
