"""Two people in browsers who do errands by what the screen shows: visible text, and where things stand on the map."""

from __future__ import annotations

import math
import re
import time
from typing import Any

WALKING, CRUISING = 10, 40
"""Cruise speed near a stopping place, so that there is time to press a key, and elsewhere [km/h]."""
LOOK = """() => {
  const all = selector => [...document.querySelectorAll(selector)];
  const shown = element => element && !element.hidden && element.getClientRects().length ? element.innerText : '';
  const map = document.querySelector('.map > canvas').getBoundingClientRect();
  const foot = element => {  // of a pin, which stands 17 px below the middle of its head
    const { x, y, width, height } = element.getBoundingClientRect();
    return [x + width / 2 - map.x - map.width / 2, y + height / 2 + 17 - map.y - map.height / 2];
  };
  const parts = (row, ...selectors) => selectors.map(each => shown(row.querySelector(each)));
  return {
    clock: shown(document.querySelector('.clock')), over: shown(document.querySelector('.over h2')),
    sign: shown(document.querySelector('.stop-sign')), status: shown(document.querySelector('.status')),
    exits: all('.exits button').map(shown), pins: all('.pins .pin').map(pin => [pin.title, ...foot(pin)]),
    told: all('.notes .told').map(row => parts(row, '.where', '.quote')),
    errands: all('.tasks > li').map(row => parts(row, '.where', 'small')),
  };
}"""
"""What a person sees: text, and pins by their distance from the car, which stands in the middle of the map [px]."""


def place_in(text: str) -> str:
    """The name of a place on a button that begins with its number."""
    return text.split("\n")[-1].strip()


class Passenger:
    """Participant who names the place of the next errand, and names it again after a while."""

    PATIENCE = 60.0

    def __init__(self, page: Any) -> None:
        self.page, self.asked, self.since = page, "", 0.0

    def look(self) -> None:
        seen = self.page.evaluate(LOOK)
        wanted = next((place_in(where) for where, state in seen["errands"] if state == "next"), "")
        if not wanted or (wanted == self.asked and time.monotonic() - self.since < self.PATIENCE):
            return
        self.asked, self.since = wanted, time.monotonic()
        kind, _, street = wanted.partition(", ")
        kind = re.sub(r" \d$", "", kind)
        self.page.fill("#words", f"Please take me to the {kind}{f' on {street}' if street else ''}.")
        self.page.press("#words", "Enter")


class Chauffeur:
    """Co-Wizard who drives towards the pin that was told last, and stops when the sign says so."""

    RESPONSE = 0.7
    """Time in which a key for the speed shows its effect; a person who presses on overshoots [s]."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.target, self.heading = "", None
        self.last: dict[str, tuple[float, float]] = {}
        self.tried: dict[tuple[str, str], int] = {}
        self.chosen = self.turned = self.held = self.pressed = 0.0

    def look(self) -> None:
        seen = self.page.evaluate(LOOK)
        if not seen["told"]:
            return
        self._listen(seen)
        self._feel(seen)
        pin = next(((x, y) for title, x, y in seen["pins"] if title.endswith(f": {self.target}")), None)
        if pin is None or self._stop(seen):
            return
        self._choose(seen, pin)

    def _listen(self, seen: dict[str, Any]) -> None:
        """Takes the place that was told last."""
        when = [(int(quote.split()[-1].replace(":", "")), place_in(where)) for where, quote in seen["told"]]
        last = max(when)[1]
        if last != self.target:
            for place in filter(None, (self.target, last)):  # the car slows down before its goal
                self.page.get_by_role("button", name=f"Goal: {place}", exact=True).click()
            self.target, self.tried = last, {}

    def _feel(self, seen: dict[str, Any]) -> None:
        """Reads the direction of driving off the pins, which move the other way."""
        for title, x, y in seen["pins"]:
            before = self.last.get(title)
            if before is not None and math.dist(before, (x, y)) >= 7.0:
                self.heading = math.atan2(before[1] - y, before[0] - x)
            if before is None or math.dist(before, (x, y)) >= 7.0:
                self.last[title] = (x, y)

    def _stop(self, seen: dict[str, Any]) -> bool:
        """Stops at the sign, waits until the errand is done, and goes on; returns whether the car is stopped."""
        now, sign = time.monotonic(), seen["sign"]
        if self.held:
            if now - self.held > 4.0:
                self.page.keyboard.press("g")
                self.held = 0.0
            return True
        if self.target in sign and sign.startswith("Stop now"):
            self.page.keyboard.press("s")
            self.held = now
            return True
        metres = float(sign.split()[-2]) if sign else math.inf
        close = self.target in sign and "behind" not in sign and metres < 35.0
        self._cruise(seen, WALKING if close else CRUISING)
        if self.target in sign and "behind" in sign and 4.0 < metres < 40.0 and now - self.turned > 15.0:
            self.page.keyboard.press("u")  # the place is on the other side of the road
            self.turned = now
        return False

    def _cruise(self, seen: dict[str, Any], wanted: int) -> None:
        cruise = re.search(r"Cruise\s+(\d+) km/h", seen["status"])
        if cruise is not None and int(cruise[1]) != wanted and time.monotonic() - self.pressed > self.RESPONSE:
            self.pressed = time.monotonic()
            self.page.keyboard.press("ArrowDown" if int(cruise[1]) > wanted else "ArrowUp")

    def _choose(self, seen: dict[str, Any], pin: tuple[float, float]) -> None:
        near = re.search(r"Junction\s+in (\d+) m", seen["status"])
        if near is None or int(near[1]) > 40 or time.monotonic() - self.chosen < 6.0:
            return
        costs = []
        street = self.target.partition(", ")[2]
        for number, text in enumerate(seen["exits"]):
            angle = float(text.split("·")[1].split("°")[0])
            away = 0.0
            if self.heading is not None:
                away = self.heading - math.radians(angle) - math.atan2(pin[1], pin[0])
                away = abs(math.atan2(math.sin(away), math.cos(away)))
            key = (f"{pin[0] / 25:.0f} {pin[1] / 25:.0f}", text)
            cost = away + 0.9 * self.tried.get(key, 0) - (0.7 if street and text.startswith(street) else 0.0)
            costs.append((cost, number, key))
        if costs:
            _, number, key = min(costs)
            self.tried[key] = self.tried.get(key, 0) + 1
            self.page.keyboard.press(str(number + 1))
            self.chosen = time.monotonic()
