"""Losses over epochs as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dorothie_gym.baselines.training.trainer import Epoch
from dorothie_gym.files import replacing
from dorothie_gym.rendering.charts import INK, SHEET, SOFT, hexadecimal
from dorothie_gym.rendering.palette import CAR, ROAD


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

    figure = Figure(figsize=(6.4, 3.6), dpi=120, facecolor=SHEET)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.11, 0.15, 0.86, 0.73), facecolor=SHEET)
    numbers = [epoch.number for epoch in epochs]
    best = epochs[-1]
    axes.plot(numbers, [epoch.training for epoch in epochs], color=hexadecimal(ROAD), label="training")
    axes.plot(numbers, [epoch.validation for epoch in epochs], color=hexadecimal(CAR), linewidth=2, label="validation")
    axes.plot([best.best], [best.lowest], "o", color=hexadecimal(CAR), label=f"kept: epoch {best.best}")
    axes.set_title(title, loc="left", fontsize=11, color=INK, weight="bold")
    axes.set_xlabel("epoch", fontsize=9, color=SOFT)
    axes.set_ylabel("loss", fontsize=9, color=SOFT)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="y", color="white")
    axes.tick_params(labelsize=8, colors=SOFT, length=0)
    axes.legend(frameon=False, fontsize=8, labelcolor=INK)
    for side in axes.spines.values():
        side.set_visible(False)
    with replacing(path) as part:
        figure.savefig(part, format="png")
