#!/usr/bin/env bash
# TextGrid 1.6.1, tgt 1.5 and praatio 6.2.2 (numpy 2.4.6): Praat annotations of one library are not read by the next.
#
# Guess before: the three Python libraries for Praat's TextGrid files read each other's files; labels and times survive.
# Seen, with a tier of intervals and a tier of points:
# - praatio reads a file in tgt's short format without its points: the tier is there, empty, and nothing warns;
# - praatio refuses every point tier that TextGrid writes: it expects the field "number", TextGrid writes "time";
# - TextGrid fails with Python's own errors on point tiers in the short format, which tgt and praatio write;
# - tgt cannot read a label of two lines, in neither format, not even from its own files; the other two can;
# - TextGrid writes times in full and rounds them to 10 microseconds when it reads them back; nothing says so.
# Long format, one line a label, points written by tgt or praatio: that is what all three read.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q numpy==2.4.6 TextGrid==1.6.1 tgt==1.5 praatio==6.2.2
cd "$folder"

cat > exchange.py <<'PYTHON'
import textgrid
import tgt
from praatio import textgrid as praat
from praatio.data_classes.interval_tier import IntervalTier
from praatio.data_classes.point_tier import PointTier

START, END = 1 / 3, 2 / 3


def by_textgrid(file, label, short):
    grid, talk, horns = (
        textgrid.TextGrid(minTime=0, maxTime=4),
        textgrid.IntervalTier("driver", 0, 4),
        textgrid.PointTier("horn", 0, 4),
    )
    talk.add(START, END, label)
    horns.add(1.5, "long")
    grid.append(talk)
    grid.append(horns)
    grid.write(file)


def by_tgt(file, label, short):
    grid, talk, horns = tgt.core.TextGrid(), tgt.core.IntervalTier(0, 4, "driver"), tgt.core.PointTier(0, 4, "horn")
    talk.add_interval(tgt.core.Interval(START, END, label))
    horns.add_point(tgt.core.Point(1.5, "long"))
    grid.add_tiers([talk, horns])
    tgt.io.write_to_file(grid, file, format="short" if short else "long")


def by_praatio(file, label, short):
    grid = praat.Textgrid()
    grid.addTier(IntervalTier("driver", [(START, END, label)], 0, 4))
    grid.addTier(PointTier("horn", [(1.5, "long")], 0, 4))
    grid.save(file, format="short_textgrid" if short else "long_textgrid", includeBlankSpaces=True)


def with_textgrid(file):
    talk, horns = textgrid.TextGrid.fromFile(file)
    return [(x.minTime, x.maxTime, x.mark) for x in talk if x.mark], [(x.time, x.mark) for x in horns]


def with_tgt(file):
    talk, horns = tgt.io.read_textgrid(file).tiers
    return [(x.start_time, x.end_time, x.text) for x in talk], [(x.time, x.text) for x in horns]


def with_praatio(file):
    grid = praat.openTextgrid(file, False)
    return [tuple(x) for x in grid.getTier("driver").entries], [tuple(x) for x in grid.getTier("horn").entries]


def outcome(read, label):
    try:
        talk, horns = read("file.TextGrid")
    except Exception as error:
        return type(error).__name__
    (start, end, text), = talk
    assert text == label
    if horns != [(1.5, "long")]:
        return f"{len(horns)} points"
    return "equal" if (start, end) == (START, END) else "rounded" if (start, end) == (0.33333, 0.66667) else "other"


seen = {}
for label in ("turn left", "turn\nleft"):
    for write in (by_textgrid, by_tgt, by_praatio):
        for short in (False, True) if write is not by_textgrid else (False,):
            write("file.TextGrid", label, short)
            row = [outcome(read, label) for read in (with_textgrid, with_tgt, with_praatio)]
            seen[label, write.__name__, short] = row
            print(f"{label!r:12} written {write.__name__:12} {'short' if short else 'long':5} "
                  f"read by TextGrid: {row[0]:10} tgt: {row[1]:10} praatio: {row[2]}")
one, two = "turn left", "turn\nleft"
for label in (one, two):
    assert seen[label, "by_textgrid", False][2] == "ParsingError"
    assert seen[label, "by_textgrid", False][0] == "rounded"
    for other in ("by_tgt", "by_praatio"):
        assert seen[label, other, True][0] == "AttributeError" and seen[label, other, False][::2] == ["rounded", "equal"]
assert all(seen[label, "by_tgt", True][2] == "0 points" for label in (one, two))
assert all(row[1] == "equal" for (label, _, _), row in seen.items() if label == one)
assert all(row[1] in ("IndexError", "ValueError", "Exception") for (label, _, _), row in seen.items() if label == two)
PYTHON
venv/bin/python exchange.py
