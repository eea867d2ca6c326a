"""Pictures of words, drawn with the DejaVu fonts that matplotlib carries: the same letters on every machine."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont

Ink: TypeAlias = tuple[int, int, int]
Picture: TypeAlias = NDArray[np.float32]
"""RGBA in 0..255 (height, width, 4) with row 0 at the bottom; alpha is the share of own light at night."""

_FINER = 2  # letters are drawn larger and scaled down
_SMALLEST = 6  # [px] font size
_LINES = 1.12  # distance of rows, relative to the font size


def lettered(
    text: str,
    size: tuple[int, int],
    *,
    ink: Ink,
    ground: Ink,
    rim: Ink | None = None,
    margin: float = 0.12,
) -> Picture:
    """Returns a panel (height, width, 4) with centred words, as large as fits.

    Args:
        text: one or more rows.
        size: width and height [px].
        ink: colour of the letters.
        ground: colour of the panel.
        rim: colour of a thin frame, if there is one.
        margin: free border, relative to the height.
    """
    from PIL import Image, ImageDraw

    width, height = size[0] * _FINER, size[1] * _FINER
    image = Image.new("RGB", (width, height), ground)
    pen = ImageDraw.Draw(image)
    inset = margin * height
    if rim is not None:
        edge = max(1, round(0.05 * height))
        pen.rectangle([edge, edge, width - 1 - edge, height - 1 - edge], outline=rim, width=edge)
        inset += edge
    rows = text.split("\n")
    points = _largest(rows, width - 2.0 * inset, height - 2.0 * inset)
    font = _font(points)
    for k, row in enumerate(rows):
        middle = height / 2.0 + (k - (len(rows) - 1) / 2.0) * _LINES * points
        left, _, right, _ = font.getbbox(row)
        # capitals are in the middle of the panel, regardless of descenders
        cap_top, cap_bottom = font.getbbox("H")[1::2]
        pen.text((width / 2.0 - (left + right) / 2.0, middle - (cap_top + cap_bottom) / 2.0), row, font=font, fill=ink)
    pixels = np.asarray(image.resize(size, Image.Resampling.BOX), dtype=np.float32)[::-1]
    return np.concatenate((pixels, np.zeros((size[1], size[0], 1), dtype=np.float32)), axis=-1)


def _largest(rows: list[str], width: float, height: float) -> int:
    """Returns the largest font size [px] at which all rows fit."""
    low, high = _SMALLEST, max(_SMALLEST, int(2.0 * height))
    while low < high:
        middle = (low + high + 1) // 2
        font = _font(middle)
        boxes = [font.getbbox(row) for row in rows]
        tall = max(bottom - top for _, top, _, bottom in boxes) + (len(rows) - 1) * _LINES * middle
        if max(right - left for left, _, right, _ in boxes) <= width and tall <= height:
            low = middle
        else:
            high = middle - 1
    return low


@lru_cache(maxsize=256)
def _font(points: int) -> FreeTypeFont:
    import matplotlib
    from PIL import ImageFont

    path = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans-Bold.ttf"
    # the basic layout is the same with and without the raqm library
    return ImageFont.truetype(path, points, layout_engine=ImageFont.Layout.BASIC)
