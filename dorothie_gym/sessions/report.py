"""What the reader of a session noticed: what it kept without understanding it, missed, or put right."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

MOST_NAMES: Final = 100
"""Different names that a report counts of one kind; the rest is counted together."""

OTHERS: Final = "(others)"


@dataclass
class ReadReport:
    """Findings of one reading.

    Attributes:
        layout: which layout was read: "native", "native-1", "release", "sample" or "hub".
        unknown: names (file, field or type) that were kept though the reader does not know them, and how often.
        missing: files and fields that are expected and are not there, and how often.
        repaired: faults that were put right, or rows that were left out, and how often.
        facts: figures of the reading, in JSON types.
    """

    layout: str = "native"
    unknown: Counter[str] = field(default_factory=Counter)
    missing: Counter[str] = field(default_factory=Counter)
    repaired: Counter[str] = field(default_factory=Counter)
    facts: dict[str, Any] = field(default_factory=dict)

    def keep(self, name: str, count: int = 1) -> None:
        """Notes something unknown that was kept."""
        _count(self.unknown, name, count)

    def miss(self, name: str, count: int = 1) -> None:
        """Notes something expected that is not there."""
        _count(self.missing, name, count)

    def repair(self, what: str, count: int = 1) -> None:
        """Notes a repair; with a count of 0 nothing."""
        if count:
            _count(self.repaired, what, count)

    def to_json(self) -> dict[str, Any]:
        """Returns the report in JSON types."""
        return {
            "layout": self.layout,
            "unknown": dict(sorted(self.unknown.items())),
            "missing": dict(sorted(self.missing.items())),
            "repaired": dict(sorted(self.repaired.items())),
            "facts": dict(self.facts),
        }

    def lines(self) -> list[str]:
        """Returns the report in words, a line each."""
        return report_lines(self.to_json())


def report_lines(report: Mapping[str, Any]) -> list[str]:
    """Returns a report, in JSON types, in words, a line each."""
    kinds = (("kept, not understood", "unknown"), ("missing", "missing"), ("repaired", "repaired"))
    lines = [f"{title}: {name}{_times(count)}" for title, kind in kinds for name, count in report[kind].items()]
    return lines + [f"{name.replace('_', ' ')}: {_in_words(value)}" for name, value in report["facts"].items()]


def _count(names: Counter[str], name: str, count: int) -> None:
    name = name if len(name) <= 200 else name[:200] + "..."
    names[name if name in names or len(names) < MOST_NAMES else OTHERS] += count


def _times(count: int) -> str:
    return "" if count == 1 else f" ({count} times)"


def _in_words(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {item}" for key, item in value.items()) or "none"
    return str(value)
