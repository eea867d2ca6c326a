"""Quantities of route talk: distances and speeds, with their units."""

from __future__ import annotations

from typing import Final

from dorothie_gym.dialogue.numerals import CAR_LENGTH, may_be_speed, read_cardinals
from dorothie_gym.dialogue.plan_items import ActionItem, DistanceItem, SpeedItem, TokenReader

_BEHIND_SPEED: Final = frozenset(
    {
        "",
        ",",
        "?",
        "when",
        "at",
        "until",
        "till",
        "by",
        "before",
        "after",
        "and",
        "then",
        "please",
        "once",
        "max",
        "tops",
    }
)
"""Words behind a number that is a speed."""
_AIMING: Final = frozenset({"to", "at", "down", "of", "under", "below", "above", "over"})
"""Words in front of a speed to drive at."""
_ROUGH: Final = frozenset({"one", "a", "an", "another", "half", "quarter", "couple", "few", "hundred"})
"""First words of numbers beside cardinals."""
_LEAST_SPEED: Final = 5
_LENGTHS: Final = frozenset({"length", "lengths"})
_THOUSANDS: Final = frozenset({"k", "ks", "k's"})
"""Units of distance that are short for kilometres an hour behind an order of speed."""

_KILOMETRE: Final = 1000.0
_LIMITING: Final = frozenset({"over", "under", "above", "below"})


class QuantityReader(TokenReader):
    """Reads quantities."""

    def read_quantity(self, place: int) -> int:
        """Reads a distance or a speed."""
        begin, aimed = place, self.word_at(place) in _AIMING
        number, end = self._number(place + aimed)
        if number is None:
            return place
        if aimed and not self._is_speed(place + 1, end):
            return place
        place += aimed
        unit = self.grammar.speeds.get(self.word_at(end))
        if unit is not None:
            self._speed(number * unit, unit=True)
            return end + 1
        if self.word_at(end) in _THOUSANDS and (aimed or self._changes_speed()):
            self._speed(number, unit=True)  # "not over fifty k"
            return end + 1
        if self.word_at(end) == "car" and self.word_at(end + 1) in _LENGTHS:
            more = self.word_at(end + 2) == "or" and self.word_at(end + 3) == "two"  # a car length or two
            self.items.append(DistanceItem(round(CAR_LENGTH * (number + 0.5 * more))))
            return end + 2 + 2 * more
        metres = self.grammar.metres.get(self.word_at(end))
        if metres is not None:
            hours, behind = self._per_hour(end + 1)
            if hours is not None:
                self._speed(number * metres * hours / 1000.0, unit=True)
                return behind
            if self.word_at(end + 1) == "and" and self.word_at(end + 3) == "half":  # a mile and a half
                number, end = number + 0.5, end + 3
            if metres >= _KILOMETRE and self._limits_speed():
                self._speed(number * metres / _KILOMETRE, unit=True)  # "maximum sixty kilometres"
                return end + 1
            self.items.append(DistanceItem(max(1, round(number * metres))))
            return end + 1
        if number >= _LEAST_SPEED and may_be_speed(self.word_at(place - 1), self.word_at(end)):
            self._speed(number, unit=False)
            return end
        return begin

    def measures(self, place: int) -> bool:
        """Returns whether a distance stands at a place: "three hundred feet"."""
        number, end = self._number(place)
        return number is not None and self.word_at(end) in self.grammar.metres and self._per_hour(end + 1)[0] is None

    def _is_speed(self, place: int, end: int) -> bool:
        """Returns whether a number behind "to" is a speed: "slow down to twenty"."""
        word, following = self.word_at(end), self.word_at(place - 2)
        if word in self.grammar.speeds or (word in self.grammar.metres and self._per_hour(end + 1)[0] is not None):
            return True
        if word in _THOUSANDS and self.word_at(place - 1) in _LIMITING:
            return True
        return self._changes_speed() and word in _BEHIND_SPEED and following != "the"

    def _changes_speed(self) -> bool:
        """Returns whether the last item is an order to drive faster or slower."""
        last = self.items[-1] if self.items else None
        return isinstance(last, ActionItem) and last.kind in ("slower", "faster", "speed")

    def _limits_speed(self) -> bool:
        """Returns whether the last item names a speed to keep: "maximum sixty kilometres"."""
        last = self.items[-1] if self.items else None
        return isinstance(last, ActionItem) and last.kind == "speed"

    def _speed(self, speed: float, *, unit: bool) -> None:
        self.items.append(SpeedItem(max(1, round(speed)), unit))

    def _per_hour(self, place: int) -> tuple[float | None, int]:
        if self.word_at(place) == "in" and self.word_at(place + 1) in ("one", "an"):
            place += 2  # "fifty kilometres in one hour"
        place += self.word_at(place) in ("per", "an", "a", "the")
        hours = self.grammar.hours.get(self.word_at(place))
        return hours, place + 1

    def _number(self, place: int) -> tuple[float | None, int]:
        """Returns a number, "half a", "a quarter" or "a couple of hundred" among them, and the place behind it."""
        word, number, start = self.word_at(place), None, place
        if word in ("a", "an", "another") or (word == "one" and self.word_at(place + 1) in self.grammar.metres):
            place, word = place + 1, self.word_at(place + 1)
        if word == "three" and self.word_at(place + 1) == "quarters":
            place += 2 + (self.word_at(place + 2) == "of")
            return 0.75, place + (self.word_at(place) in ("a", "an"))
        if word in ("half", "quarter"):
            place += 1 + (self.word_at(place + 1) == "of")
            place += self.word_at(place) in ("a", "an")
            return (0.5 if word == "half" else 0.25), place
        if word in ("couple", "few"):
            place += 1 + (self.word_at(place + 1) == "of")
            if self.word_at(place) == "hundred":
                return 100.0 * (2 if word == "couple" else 3), place + 1
            return None, start
        if word == "hundred":
            number, place = 100.0, place + 1
        elif place > start and (word in self.grammar.metres or (word == "car" and self.word_at(place + 1) in _LENGTHS)):
            return 1.0, place
        else:
            length = self._run(place)
            if length:
                number = float(read_cardinals([*self.words[place : place + length]])[0])
                place += length
                if self.word_at(place) == "point" and (digit := self._run(place + 1)):
                    number += read_cardinals([*self.words[place + 1 : place + 1 + digit]])[0] / 10.0
                    place += 1 + digit
        if number == 100.0 and self.word_at(place) == "and" and (more := self._run(place + 1)):
            number, place = number + read_cardinals(list(self.words[place + 1 : place + 1 + more]))[0], place + 1 + more
        return (None, start) if number is None else (number, place)

    def _run(self, place: int) -> int:
        """Returns the number of tokens of the cardinal at a place; 0 without any."""
        length = 0
        while (
            place + length < len(self.words) and len(read_cardinals(list(self.words[place : place + length + 1]))) == 1
        ):
            if not read_cardinals([self.words[place + length]]) and self.words[place + length] != "hundred":
                break
            length += 1
        return length


def begins_quantity(word: str) -> bool:
    """Returns whether a word may begin what `QuantityReader.read_quantity` reads."""
    return word in _AIMING or word in _ROUGH or bool(read_cardinals([word]))
