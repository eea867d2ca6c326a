"""The learning curve as a picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from dorothie_gym.rendering.charts import INK, SHEET, SOFT, empty_figure, hexadecimal
from dorothie_gym.rendering.palette import CAR

SIZE = (7.0, 4.0)
"""Of the picture [inches]."""

DOTS = 150
"""Dots an inch."""


@contextmanager
def sheet(path: Path) -> Iterator[Any]:
    """An empty figure, which is written into a PNG file when all is drawn.

    Raises:
        OSError: the file cannot be written.
    """
    with empty_figure(*SIZE) as figure:
        figure.set_layout_engine("constrained")
        yield figure
        figure.savefig(path, format="png", dpi=DOTS)


def draw_curve(rows: Sequence[Mapping[str, Any]], title: str, path: Path) -> None:
    """Draws success with its interval, and the reward, over the steps into a PNG file.

    Args:
        rows: evaluations, as `training.Row.as_json` has them.
        title: above the picture.
        path: file to write.

    Raises:
        OSError: the file cannot be written.
    """
    steps = [row["steps"] / 1e3 for row in rows]
    with sheet(path) as figure:
        axes = figure.add_subplot()
        axes.set_facecolor(SHEET)
        axes.fill_between(
            steps, [row["low"] for row in rows], [row["high"] for row in rows], color=hexadecimal(CAR), alpha=0.2, lw=0
        )
        axes.plot(steps, [row["success"] for row in rows], color=hexadecimal(CAR), lw=2, marker="o", ms=3)
        axes.set(ylim=(-0.02, 1.02), xlabel="thousand steps", ylabel=f"success of {rows[-1]['episodes']} episodes")
        axes.yaxis.label.set_color(hexadecimal(CAR))
        rewards = axes.twinx()
        rewards.plot(steps, [row["reward"] for row in rows], color=SOFT, lw=1.2, ls="--")
        rewards.set_ylabel("mean reward of an episode (dashed)", color=SOFT)
        axes.set_title(f"{title}; {rows[-1]['seconds'] / 60:.1f} min of training", color=INK, fontsize=10)
