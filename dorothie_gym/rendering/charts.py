"""How charts look: the ink and paper of all pictures, for matplotlib."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from dorothie_gym.rendering import palette

DOTS: Final = 130
"""Dots an inch."""

GRID: Final = "#e2ddd1"
BAND: Final = "#f2ede1"
"""Behind every other row."""


def hexadecimal(colour: palette.Colour) -> str:
    """A colour as matplotlib takes it."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


INK: Final = hexadecimal(palette.INK)
SOFT: Final = hexadecimal(palette.INK_SOFT)
SHEET: Final = hexadecimal(palette.SHEET)


@contextmanager
def empty_figure(width: float, height: float) -> Iterator[Any]:
    """A matplotlib figure to draw on within the context; it needs no display.

    Args:
        width: of the picture [inches].
        height: of the picture [inches].
    """
    # imported here: matplotlib is slow to import, and a picture is not always wanted
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with rc_context({"font.family": "DejaVu Sans", "text.color": INK, "axes.labelcolor": SOFT}):
        figure = Figure(figsize=(width, height), dpi=DOTS, facecolor=SHEET)
        FigureCanvasAgg(figure)
        yield figure


def dress_percent_axes(axes: Any, title: str, rows: int, *, margin: float) -> None:
    """Makes axes a panel of rows of dots between 0 and 100 per cent.

    Args:
        axes: of matplotlib; row k is at height k.
        title: above the panel.
        rows: how many; every other one has a band behind it.
        margin: room beside 0 and 100 [per cent].
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
