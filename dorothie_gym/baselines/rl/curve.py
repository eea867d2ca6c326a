"""The learning curve as a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dorothie_gym.world.graphics.palette import CAR, INK, INK_SOFT, SHEET, Colour

SIZE = (7.0, 4.0)
"""Of the picture [inches]."""

DOTS = 150
"""Dots an inch."""


def draw_curve(rows: Sequence[Mapping[str, Any]], title: str, path: Path) -> None:
    """Draws success with its interval, and the reward, over the steps into a PNG file.

    Args:
        rows: evaluations, as `training.Row.as_json` has them.
        title: above the picture.
        path: file to write.

    Raises:
        OSError: the file cannot be written.
    """
    # imported here: matplotlib is slow to import
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    steps = [row["steps"] / 1e3 for row in rows]
    with rc_context({"font.family": "DejaVu Sans", "font.size": 9}):
        figure = Figure(figsize=SIZE, dpi=DOTS, facecolor=hex_of(SHEET), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        axes.set_facecolor(hex_of(SHEET))
        axes.fill_between(
            steps, [row["low"] for row in rows], [row["high"] for row in rows], color=hex_of(CAR), alpha=0.2, lw=0
        )
        axes.plot(steps, [row["success"] for row in rows], color=hex_of(CAR), lw=2, marker="o", ms=3)
        axes.set(ylim=(-0.02, 1.02), xlabel="thousand steps", ylabel=f"success of {rows[-1]['episodes']} episodes")
        axes.yaxis.label.set_color(hex_of(CAR))
        rewards = axes.twinx()
        rewards.plot(steps, [row["reward"] for row in rows], color=hex_of(INK_SOFT), lw=1.2, ls="--")
        rewards.set_ylabel("mean reward of an episode (dashed)", color=hex_of(INK_SOFT))
        axes.set_title(f"{title}; {rows[-1]['seconds'] / 60:.1f} min of training", color=hex_of(INK), fontsize=10)
        figure.savefig(path, format="png")


def hex_of(colour: Colour) -> str:
    """A colour as matplotlib takes it."""
    return "#{:02x}{:02x}{:02x}".format(*colour[:3])
