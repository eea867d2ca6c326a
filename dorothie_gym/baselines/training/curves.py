"""Losses over epochs as a picture."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from dorothie_gym.baselines.training.trainer import Epoch
from dorothie_gym.world.graphics.palette import CAR, INK, INK_SOFT, ROAD, SHEET, Colour


def draw_curves(epochs: Sequence[Epoch], title: str, path: Path) -> None:
    """Draws training and validation loss into a PNG file; the epoch that is kept is marked.

    Args:
        epochs: at least one.
        title: name of the model.
        path: file to write, whole or not at all.

    Raises:
        OSError: the file cannot be written.
    """
    # imported here: matplotlib is slow to import
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    figure = Figure(figsize=(6.4, 3.6), dpi=120, facecolor=_hex(SHEET))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.11, 0.15, 0.86, 0.73), facecolor=_hex(SHEET))
    numbers = [epoch.number for epoch in epochs]
    best = epochs[-1]
    axes.plot(numbers, [epoch.training for epoch in epochs], color=_hex(ROAD), label="training")
    axes.plot(numbers, [epoch.validation for epoch in epochs], color=_hex(CAR), linewidth=2, label="validation")
    axes.plot([best.best], [best.lowest], "o", color=_hex(CAR), label=f"kept: epoch {best.best}")
    axes.set_title(title, loc="left", fontsize=11, color=_hex(INK), weight="bold")
    axes.set_xlabel("epoch", fontsize=9, color=_hex(INK_SOFT))
    axes.set_ylabel("loss", fontsize=9, color=_hex(INK_SOFT))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="y", color="white")
    axes.tick_params(labelsize=8, colors=_hex(INK_SOFT), length=0)
    axes.legend(frameon=False, fontsize=8, labelcolor=_hex(INK))
    for side in axes.spines.values():
        side.set_visible(False)
    part = path.with_name(path.name + ".part")
    figure.savefig(part, format="png")
    os.replace(part, path)


def _hex(colour: Colour) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)
