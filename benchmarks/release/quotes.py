"""Places of README and docs that state measured figures: comparison with the file of figures, and renewal.

A quote is a piece of a page with fields: "simulates [{speed-world.substeps:,.0f} substeps]". Its text must be on
the page once, where line breaks count as spaces. A number of a complete page that stands in no quote must be in one
of the texts that are stated for the page, which are definitions and not measured.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.release.figures import Figure
from dorothie_gym.errors import DorothieGymError
from dorothie_gym.support.files import write_atomically

ROOT: Final = Path(__file__).parents[2]
FILE: Final = Path(__file__).with_name("quotes.toml")

_FIELD: Final = re.compile(r"\{([\w.-]+)(?::([^{}]+))?\}")
_VALUE: Final = r"([\d.,%\[\]\s−-]+?)"
_NUMBER: Final = re.compile(r"(?<![\w.-])\d(?:[\d,.]*\d)?(?![\w])")
_UNMEASURED: Final = re.compile(r"```.*?```|`[^`]*`|\]\([^)]*\)|<!--.*?-->|^\d+\. |^#.*?$", re.DOTALL | re.MULTILINE)
"""Code, targets of links, comments, headings and numbers of lists: what they contain is not measured."""


class QuoteError(DorothieGymError, ValueError):
    """A quote that is not on its page, or names no figure."""


@dataclass(frozen=True, kw_only=True)
class Quote:
    """Text of a page with fields for figures.

    Attributes:
        page: path of the page within the checkout.
        text: text with fields "{STEP.NAME:FORMAT}".
    """

    page: str
    text: str

    def found(self, content: str) -> re.Match[str]:
        """Returns the place of the quote in the content of its page; each field is a group.

        Raises:
            QuoteError: it is not there, or several times.
        """
        parts = _FIELD.split(self.text)[::3]  # without names and formats
        pattern = _VALUE.join(r"\s+".join(map(re.escape, re.split(r"\s+", part))) for part in parts)
        places = list(re.finditer(pattern, content))
        if len(places) != 1:
            raise QuoteError(f"{self.page} has {len(places)} times: {self.text}; correct page or {FILE.name}")
        return places[0]

    def values(self, figures: Mapping[str, Figure]) -> list[str]:
        """Returns the figures of the fields as the page must state them.

        Raises:
            QuoteError: there is no such figure.
        """
        names = _FIELD.findall(self.text)
        unknown = [name for name, _ in names if name not in figures]
        if unknown:
            raise QuoteError(f"{self.page}: there is no figure {unknown[0]}; measure it, or correct {FILE.name}")
        return [figures[name].shown(layout) for name, layout in names]


@dataclass(frozen=True, kw_only=True)
class QuoteFile:
    """Content of `quotes.toml`.

    Attributes:
        complete: pages on which every number is quoted or stated.
        quotes: the quotes.
        stated: texts with numbers that are not measured, by page.
    """

    complete: tuple[str, ...]
    quotes: tuple[Quote, ...]
    stated: Mapping[str, Sequence[str]]

    @classmethod
    def load(cls, path: Path = FILE) -> QuoteFile:
        """Returns the content of a file."""
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        return cls(
            complete=tuple(content["complete"]),
            quotes=tuple(Quote(**each) for each in content["quote"]),
            stated=content["stated"],
        )

    def differences(self, figures: Mapping[str, Figure]) -> Iterator[str]:
        """Yields where a page differs from the figures, in words; raises `QuoteError` as `Quote`."""
        for quote in self.quotes:
            place = quote.found(_content(quote.page))
            for value, wanted in zip(place.groups(), quote.values(figures), strict=True):
                if " ".join(value.split()) != wanted:
                    yield f"{quote.page}: {' '.join(value.split())!r} must be {wanted!r} in: {quote.text}"

    def uncovered(self, page: str) -> list[str]:
        """Returns the numbers of a page that are neither quoted nor stated, with the words around them."""
        content = _content(page)
        covered = [_span(quote.found(content)) for quote in self.quotes if quote.page == page]
        covered += [_span(Quote(page=page, text=text).found(content)) for text in self.stated.get(page, ())]
        covered += [_span(match) for match in _UNMEASURED.finditer(content)]
        return [
            " ".join(content[max(0, number.start() - 30) : number.end() + 30].split())
            for number in _NUMBER.finditer(content)
            if not any(begin <= number.start() and number.end() <= end for begin, end in covered)
        ]

    def renew(self, figures: Mapping[str, Figure]) -> list[str]:
        """Writes the figures into the pages, and returns the pages that changed; raises `QuoteError` as `Quote`."""
        changed = []
        for page in dict.fromkeys(quote.page for quote in self.quotes):
            content = before = _content(page)
            for quote in self.quotes:
                if quote.page == page:
                    content = _renewed(content, quote, quote.values(figures))
            if content != before:
                write_atomically(ROOT / page, content)
                changed.append(page)
        return changed


def _content(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def _span(match: re.Match[str]) -> tuple[int, int]:
    return match.span()


def _renewed(content: str, quote: Quote, values: Sequence[str]) -> str:
    place = quote.found(content)
    for group in range(len(values), 0, -1):  # from the end, so that earlier places stay valid
        if " ".join(place[group].split()) != values[group - 1]:
            content = content[: place.start(group)] + values[group - 1] + content[place.end(group) :]
    return content
