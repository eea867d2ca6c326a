"""Charts of learning curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dorothie_gym.pictures.chart_style import INK, SHEET, SOFT, empty_figure, hexadecimal
from dorothie_gym.pictures.palette import CAR, ROAD
from dorothie_gym.support.files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dorothie_gym.baselines.trainer import Epoch


def draw_loss_curves(epochs: Sequence[Epoch], title: str, path: Path) -> None:
    """Draws training and validation loss into a PNG file; the epoch that is kept is marked.

    Args:
        epochs: at least one epoch.
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


# --- The learning curve as a picture ---------------------------------------------------------------------------------

FIGURE_SIZE = (7.0, 4.0)
"""Width and height of the picture [inches]."""

DOTS_PER_INCH = 150
"""Resolution of the picture [1/inch]."""


@contextmanager
def sheet(path: Path) -> Iterator[Figure]:
    """Yields an empty figure, and writes it to a PNG file at the end.

    Raises:
        OSError: the file cannot be written.
    """
    with empty_figure(*FIGURE_SIZE) as figure:
        figure.set_layout_engine("constrained")
        yield figure
        with replacing(path) as part:
            figure.savefig(part, format="png", dpi=DOTS_PER_INCH)


def draw_reward_curve(rows: Sequence[Mapping[str, Any]], title: str, path: Path) -> None:
    """Draws success with its interval, and the reward, over the steps into a PNG file.

    Args:
        rows: evaluations, as from `training.TrainingEvaluation.as_json`.
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
        axes.set_title(f"{title}; one seed, {rows[-1]['seconds'] / 60:.1f} min of training", color=INK, fontsize=10)
