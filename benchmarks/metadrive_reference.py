"""MetaDrive as a reference of speed, where it is installed.

Li et al. 2022, "MetaDrive: composing diverse driving scenarios for generalizable reinforcement learning".
"""

from __future__ import annotations

import warnings
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

LOG_LEVEL: Final = 50
"""Level of MetaDrive's messages: errors only."""

SETTINGS: Final = {"use_render": False, "log_level": LOG_LEVEL, "map": 3, "traffic_density": 0.1}
"""Default environment of MetaDrive without rendering: a road of three blocks; observations are rays and navigation."""


class MetaDriveReference:
    """Environment of MetaDrive that is driven straight on."""

    def __init__(self, seed: int, picture: tuple[int, int] | None = None) -> None:
        """Makes the environment.

        Args:
            seed: seed of the road and its traffic.
            picture: width and height of the pictures that are observed; None for rays.
        """
        environment: Any = import_module("metadrive").MetaDriveEnv
        settings: dict[str, object] = {**SETTINGS, "start_seed": seed, "num_scenarios": 1}
        if picture is not None:
            camera: Any = import_module("metadrive.component.sensors.rgb_camera").RGBCamera
            settings |= {
                "image_observation": True,
                "stack_size": 1,
                "sensors": {"rgb_camera": (camera, *picture)},
                "vehicle_config": {"image_source": "rgb_camera"},
            }
        self._env = environment(settings)
        self._over = True

    def prepare(self) -> None:
        """Begins an episode if none is in progress."""
        if self._over:
            self._env.reset()
            self._over = False

    def step(self) -> None:
        """Takes a step of 0.1 s."""
        _, _, terminated, truncated, _ = self._env.step([0.0, 0.3])
        self._over = terminated or truncated

    def close(self) -> None:
        """Closes the environment."""
        self._env.close()


def metadrive_reference(seed: int, picture: tuple[int, int] | None = None) -> MetaDriveReference | None:
    """Returns the environment of MetaDrive; None if the package or, with a warning, its assets are not installed.

    Args:
        seed: seed of the road and its traffic.
        picture: width and height of the pictures that are observed; None for rays.
    """
    found = find_spec("metadrive")
    if found is None or found.origin is None:
        return None
    if not (Path(found.origin).parent / "assets" / "version.txt").exists():  # MetaDrive would download them
        warnings.warn(
            "MetaDrive is not measured: its assets are missing; `python -m metadrive.pull_asset` downloads them",
            stacklevel=2,
        )
        return None
    return MetaDriveReference(seed, picture)
