"""The three layouts of an SDN session, told apart by the files that are there."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Final

FRAMES_EACH: Final = 3
"""Our frames (30 Hz) in one of SDN's (10 Hz)."""

SDN_RATE: Final = 10.0
"""SDN's frames a second."""

CONFIG_FILE: Final = "config.json"
LOG_FILE: Final = "annotated_log.json"
PLAN_FILE: Final = "plan.json"
DETAILED_PLAN_FILE: Final = "detailed_plan.json"
PLACES_FILE: Final = "trajectory.csv"
AD_WIZARD_FILE: Final = "ad_wizardlog.csv"
GAMELOG_FILE: Final = "gamelog.json"
TASK_FILE: Final = "task.json"
DIALOG_FILE: Final = "dialog_log.json"
SCENE_FILE: Final = "dorothie_gym_scene.parquet"
"""What was around the car, which the layout has no place for: a file of ours, laid out as `frames.parquet`."""

OURS: Final = "dorothie_gym"
"""Field of `config.json`, and of rows of the log, that holds what only our sessions have."""


MORE: Final = "more"
"""Field of a row, of its act or of its value that holds further fields of our events."""


class SdnLayout(enum.StrEnum):
    """A layout."""

    RELEASE = "release"
    SAMPLE = "sample"
    HUB = "hub"


_LOGS: Final = {SdnLayout.RELEASE: LOG_FILE, SdnLayout.SAMPLE: GAMELOG_FILE, SdnLayout.HUB: DIALOG_FILE}

_FILES: Final = {
    SdnLayout.RELEASE: (CONFIG_FILE, LOG_FILE, PLAN_FILE, DETAILED_PLAN_FILE, PLACES_FILE, AD_WIZARD_FILE, SCENE_FILE),
    SdnLayout.SAMPLE: (CONFIG_FILE, GAMELOG_FILE, TASK_FILE, PLACES_FILE),
    SdnLayout.HUB: (DIALOG_FILE,),
}


def detect_layout(folder: Path) -> SdnLayout | None:
    """Returns the layout of a folder; None where it holds no SDN session."""
    return next((layout for layout, name in _LOGS.items() if (folder / name).is_file()), None)


def log_file(layout: SdnLayout) -> str:
    """Returns the name of the file with the events."""
    return _LOGS[layout]


def expected_files(layout: SdnLayout) -> tuple[str, ...]:
    """Returns the names of the files that are read."""
    return _FILES[layout]
