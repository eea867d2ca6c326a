"""Style of charts: ink and paper of all pictures, for matplotlib."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from dorothie_gym.pictures import palette

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CHART_RESOLUTION: Final = 130
"""Dots per inch."""

GRID: Final = "#e2ddd1"
BAND: Final = "#f2ede1"
"""Background of every other row."""


def hexadecimal(colour: palette.Colour) -> str:
    """Returns a colour in matplotlib's notation."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


INK: Final = hexadecimal(palette.INK)
SOFT: Final = hexadecimal(palette.INK_SOFT)
SHEET: Final = hexadecimal(palette.SHEET)


@contextmanager
def empty_figure(width: float, height: float) -> Iterator[Figure]:
    """Creates a matplotlib figure for use within the context; it needs no display.

    Args:
        width: width of the picture [inches].
        height: height of the picture [inches].
    """
    # imported on demand: matplotlib is slow to import
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with rc_context({"font.family": "DejaVu Sans", "text.color": INK, "axes.labelcolor": SOFT}):
        figure = Figure(figsize=(width, height), dpi=CHART_RESOLUTION, facecolor=SHEET)
        FigureCanvasAgg(figure)
        yield figure


def dress_percent_axes(axes: Axes, title: str, rows: int, *, margin: float) -> None:
    """Styles axes as a panel of rows of dots between 0 and 100 per cent.

    Args:
        axes: matplotlib axes; row k is at y = k.
        title: title above the panel.
        rows: number of rows; every other one has a band behind it.
        margin: margin beyond 0 and 100 [per cent].
    """
    for row in range(0, rows, 2):
        axes.axhspan(row - 0.5, row + 0.5, color=BAND, zorder=0)
    axes.set_facecolor(SHEET)
    axes.set_title(title, fontsize=10, color=INK, pad=8)
    axes.set_xlim(-margin, 100 + margin)
    axes.set_xticks((0, 25, 50, 75, 100), ("0", "", "50", "", "100"))
    axes.tick_params(axis="both", length=0)
    axes.tick_params(axis="x", labelsize=8, labelcolor=SOFT)
    axes.grid(axis="x", color=GRID, linewidth=0.9)
    axes.set_axisbelow(True)
    axes.set_xlabel("per cent", fontsize=8)
    for spine in axes.spines.values():
        spine.set_visible(False)
