"""Charts of the summaries of measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from benchmarks.report import number
from dorothie_gym.pictures.chart_style import GRID, INK, SHEET, SOFT, hexadecimal
from dorothie_gym.pictures.palette import CAR, LIGHT_RED, ROAD

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from benchmarks.report import Report

CHART_WIDTH: Final = 9.0
"""Width of the chart [inches]."""

CHART_DPI: Final = 150
"""Resolution of the chart."""

_ROW_HEIGHT, _MARGINS = 0.72, 1.95
_FONT = "DejaVu Sans"
_LONGEST_SUBJECT = 115  # characters in a line of 9 points


def draw(report: Report, path: Path) -> None:
    """Draws a report into a PNG file.

    Args:
        report: the report.
        path: file to write.

    Raises:
        OSError: the file cannot be written.
    """
    # imported here: matplotlib is slow to import
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with rc_context({"font.family": _FONT}):
        rows, notes = _ROW_HEIGHT * len(report.rows), 0.2 * len(report.notes)
        height = rows + _MARGINS + notes
        figure = Figure(figsize=(CHART_WIDTH, height), dpi=CHART_DPI, facecolor=SHEET)
        FigureCanvasAgg(figure)
        _write_texts(figure, report, height)
        axes = figure.add_axes(
            (0.29, (0.83 + 0.2 * len(report.notes)) / height, 0.66, _ROW_HEIGHT * len(report.rows) / height)
        )
        _draw_rows(axes, report)
        figure.savefig(path, format="png")


def _write_texts(figure: Figure, report: Report, height: float) -> None:
    """Writes headline, title and setting above the bars, notes and machine below them."""

    def write(inches: float, text: str, size: float, colour: str, weight: str = "normal") -> None:
        figure.text(0.03, inches / height, text, va="baseline", fontsize=size, color=colour, weight=weight)

    write(height - 0.42, report.headline[0].upper() + report.headline[1:], 13.5, INK, "bold")
    subject = f"{report.title} · {report.setting}"
    write(height - 0.72, subject, min(9.0, 9.0 * _LONGEST_SUBJECT / len(subject)), SOFT)
    for k, note in enumerate(reversed(report.notes)):
        write(0.36 + 0.2 * k, note, 8.5, INK)
    write(0.14, report.machine, 7, SOFT)


def _draw_rows(axes: Axes, report: Report) -> None:
    values = [row.value for row in report.rows]
    known = [*values, report.mark.value] if report.mark else values
    places = range(len(values))
    if report.logarithmic:
        axes.set_xscale("log")
        left, right = min(known) / 3.0, max(known) * 12.0
    else:
        left, right = 0.0, max(known) * 1.25
    axes.set_xlim(left, right)
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:,.10g}")
    colours = [hexadecimal(ROAD if row.reference else CAR) for row in report.rows]
    if report.logarithmic:  # dots, because the length of a bar would mean nothing: the axis has no zero
        axes.hlines(list(places), left, right, color=GRID, linewidth=1.0, zorder=1)
        axes.scatter(values, list(places), s=110, color=colours, zorder=3)
    else:
        axes.barh(places, values, height=0.56, color=colours, zorder=2)
    gap = 10 if report.logarithmic else 6
    for k, row in enumerate(report.rows):
        axes.annotate(
            number(row.value), (row.value, k), xytext=(gap, 0), textcoords="offset points", va="center", fontsize=11,
            weight="bold", color=colours[k], zorder=4, bbox={"facecolor": SHEET, "edgecolor": "none", "pad": 1.5},
        )  # fmt: skip
    if report.mark is not None:
        axes.axvline(report.mark.value, color=hexadecimal(LIGHT_RED), linewidth=1.4, linestyle=(0, (4, 3)), zorder=3)
        axes.annotate(
            report.mark.label,
            (report.mark.value, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(4, 3),
            textcoords="offset points",
            fontsize=8.5,
            color=hexadecimal(LIGHT_RED),
        )
    axes.set_yticks(list(places), [row.label for row in report.rows], fontsize=9, color=INK)
    axes.set_ylim(len(values) - 0.5, -0.5)
    axes.set_xlabel(report.unit + (" (logarithmic)" if report.logarithmic else ""), fontsize=8.5, color=SOFT)
    axes.tick_params(axis="x", labelsize=8, colors=SOFT, which="both", length=0)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", color="white", linewidth=1.0, zorder=0)
    axes.set_facecolor(SHEET)
    for side in axes.spines.values():
        side.set_visible(False)
