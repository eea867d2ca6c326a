"""Films as files: whether one can be written, and what writes it."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

from dorothie_gym.cli.output import check_file, fail

_SUFFIXES = (".mp4", ".mkv", ".mov")


def check_video(path: Path) -> None:
    """Fails where a film cannot be written at `path`, before anything takes time."""
    if path.suffix.lower() not in _SUFFIXES:
        fail(f"{path}: no format of a film; give a name that ends in {', '.join(_SUFFIXES)}")
    check_file(path)
    if find_spec("imageio") is None or find_spec("imageio_ffmpeg") is None:
        fail("--video needs imageio, which is not installed; run: pip install 'dorothie-gym[video]'")


def video_writer(path: Path, frames_per_second: float) -> Any:
    """Returns imageio's writer of a film; raises `ImportError` where the extra `video` is not installed."""
    import imageio.v2 as imageio

    return imageio.get_writer(path, fps=frames_per_second, macro_block_size=16, ffmpeg_params=["-preset", "veryfast"])
