"""Rule program that plays the Co-Wizard by reading prompts, as a language model does: it sees nothing but the text.

It understands the passenger by the package's own parser of words, and keeps what it has to remember in its note. It
shows that a prompt says enough to drive by: what it cannot do, a language model can hardly do.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import takewhile
from typing import Any

from dorothie_gym.dialogue import Direction, ParsedText, guess_spans, understand
from dorothie_gym.dialogue.routes import ConditionRelation, PlanStep, StepAction, StepChange
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, GoalStatus, LandmarkName, Slot, StreetName

USUAL_SPEED = 40
SEARCH_SPEED = 30  # on the street of a place that is not on the map
SLOW_TIME = 25.0
NAMES = [name for name in LandmarkName if name not in (LandmarkName.UNKNOWN, LandmarkName.QUERIED)]
SAME_EVERYWHERE = (LandmarkName.HOUSE, LandmarkName.PERSON)
SIDES = (Direction.LEFT, Direction.RIGHT, Direction.STRAIGHT)
STEERING = (ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_SWITCH)
WRONG = re.compile(r"wrong (way|direction|turn)|passed it|past it|missed it|other way|the other one|behind us")
NEAR = re.compile(r"(nearly|almost) (there|at)|(just|right|up) ahead|coming up|not far|(very|getting) close|near now")
NEAR_SPEED = 20  # at which "stop" still comes in time
HERE = re.compile(r"right here|this is it|here we are|we're here|there it is|this is the place|that's it")
QUESTIONS = (DialogueMove.QUERY_W, DialogueMove.QUERY_YN, DialogueMove.CHECK, DialogueMove.ALIGN)


@dataclass
class Page:
    """Prompt, read into fields."""

    time: float
    car: str
    speed: float
    cruise: int
    street: str
    prepared: str
    exits: list[tuple[int, str, str, float]]  # angle, direction, street, distance
    places: dict[str, str]  # street by label
    away: dict[str, float]  # distance by label
    visited: list[str]
    others: list[str]
    goal: str
    there: bool
    routed: bool
    off_map: bool
    marked: bool
    step: str
    due: bool
    note: dict[str, str]
    heard: list[str]
    last_said: float
    events: list[str]
    drives: list[str]
    lines: list[str] = field(repr=False)

    @property
    def stopped(self) -> bool:
        return self.car.startswith("told to stop")


def read_page(text: str) -> Page:
    lines = text.split("\n")

    def after(title: str) -> str:
        return next((line[len(title) :].strip() for line in lines if line.startswith(title)), "")

    def listed(title: str) -> list[str]:
        start = next((k for k, line in enumerate(lines) if line.startswith(title)), None)
        found: list[str] = []
        for line in lines[start + 1 :] if start is not None else []:
            if not line.startswith("- "):
                break
            found.append(line[2:])
        return found

    car, goal, route = after("Car:"), after("Goal:"), after("Route:")
    exits = []
    for line in listed("Exits"):
        found = re.match(r"JTurn (-?\d+): (\w+), into (.*), in (\d+) m", line)
        assert found is not None, line
        exits.append((int(found[1]), found[2], found[3], float(found[4])))
    places, away, visited = {}, {}, list[str]()
    for line in listed("Places"):
        found = re.match(r"(.*), on (.*), (\d+) m away[^;]*(;.*)?", line)
        assert found is not None, line
        label, street, distance, been = found.groups()
        places[label], away[label] = street, float(distance)
        if been:
            visited.append(label)
    talk = [re.match(r"(\d+):(\d\d) (\w+): (.*)", line) for line in listed("Conversation")]
    said = [60 * int(line[1]) + int(line[2]) for line in talk if line is not None and line[3] == "you"]
    events = listed("Just now")
    minutes, seconds = after("Time:").split(":")
    return Page(
        time=60.0 * int(minutes) + int(seconds),
        car=car,
        speed=float(re.search(r"(\d+) km/h, cruise", car)[1]),  # type: ignore[index]
        cruise=int(re.search(r"cruise speed (\d+)", car)[1]),  # type: ignore[index]
        street=after("Place:").split(";")[0],
        prepared=after("Prepared:"),
        exits=exits,
        places=places,
        away=away,
        visited=visited,
        others=[f"another {label.split(' on ')[0]}" for label in places],
        goal=goal.split(",")[0],
        there="you are there" in goal,
        routed=("by the route" in goal or "you are there" in goal) and "marked" not in goal,
        off_map="not on your map" in goal,
        marked="marked" in goal,
        step=route.partition(": ")[2],
        due=route.startswith("now"),
        note=dict(part.split("=", 1) for part in after("Your note:").split("; ") if "=" in part),
        heard=[event[21:-1] for event in events if event.startswith("The passenger said")],
        last_said=float(max(said, default=-100)),
        events=events,
        drives=after("You can drive:").split(", "),
        lines=lines,
    )


class CoWizardReader:
    """Answers prompts of the Co-Wizard."""

    def __call__(self, prompt: str) -> dict[str, str]:
        page = read_page(prompt)
        answer = {
            "drive": "none",
            "goal": "keep",
            "mark": "none",
            "status": "keep",
            "say": "",
            "note": "",
            "again": "10",
        }
        note = page.note
        for text in page.heard:
            self._hear(page, text, note, answer)
        self._drive(page, note, answer)
        answer["note"] = "; ".join(f"{name}={value}" for name, value in note.items() if value)
        if any(name in note for name in ("turn", "wish", "go")):
            far = "wish" not in note and "go" not in note and page.exits and page.exits[0][3] > 120
            answer["again"] = "3" if far else "1"
        return answer

    # --- listening --------------------------------------------------------------------------------------------------

    def _hear(self, page: Page, text: str, note: dict[str, str], answer: dict[str, str]) -> None:
        words, low = understand(text), text.lower()
        missed = WRONG.search(low) is not None
        if missed:
            self._doubt(page, note, answer)
            _forget_turn(note)
        if HERE.search(low) and not page.routed and page.speed > 0:
            self._stop(page, note, answer)
            return
        for span in guess_spans(text) if not missed else ():
            self._take(page, span.act, words, note, answer)
        self._follow(page, words, note, answer)
        if NEAR.search(low) and not page.routed:
            _slow(page, note, NEAR_SPEED)
        if not answer["say"] and text.rstrip().endswith("?"):
            answer["say"] = "Yes."

    def _take(
        self, page: Page, act: DialogueAct, words: ParsedText, note: dict[str, str], answer: dict[str, str]
    ) -> None:
        landmarks = [name for name in act.values(Slot.LANDMARK) if name in NAMES]
        actions = [value for value in act.values(Slot.ACTION) if value is not ActionValue.QUERIED]
        statuses = act.values(Slot.STATUS)
        if act.move in QUESTIONS:
            answer["say"] = answer["say"] or _reply(page, act)
            return
        if GoalStatus.COMPLETE in statuses or GoalStatus.ABANDONED in statuses:
            done = GoalStatus.COMPLETE in statuses
            if not landmarks or landmarks[0].label in page.goal:
                answer.update(goal="none", status="Complete" if done else "Abandoned", say="All right.")
                note.clear()
                note["halt"] = "1"
            return
        steers = any(action in STEERING for action in actions)
        landmarks = [name for name in landmarks if name not in words.dropped]
        if landmarks and not steers and GoalStatus.PENDING not in statuses:
            self._aim(page, landmarks[0], words, note, answer)

    def _follow(self, page: Page, words: ParsedText, note: dict[str, str], answer: dict[str, str]) -> None:
        """Takes the steps that the passenger asks for: the first at once, later turns when it is their time."""
        pending = GoalStatus.PENDING in words.statuses  # of something later
        unmeant = (StepAction.VISIT, StepAction.STOP) if pending else (StepAction.VISIT,)
        steps = [step for step in words.plan.steps or _told(words) if step.action not in unmeant]
        steering = [step for step in steps if step.action in (StepAction.TURN, StepAction.U_TURN, StepAction.LANE)]
        if steering:
            if page.routed and answer["goal"] == "keep" and not _is_on_route(page, steering[0]):
                self._doubt(page, note, answer)
                if answer["goal"] == "keep" and "off" in note:  # for the second time: another place is meant
                    answer["goal"] = "none"
                note["off"] = "1"
            if page.marked and answer["goal"] == "keep":  # the place is not where it was supposed
                answer["goal"] = "none" if page.goal == "an unknown place" else page.goal
        for step in steps[: 1 if steering and steps[0] is steering[0] else len(steps)]:
            self._obey(page, step, words, note, answer)
        later = list(takewhile(_is_plain_turn, steps[1:]))
        if steering and steps[0] is steering[0] and not page.routed:
            note["then"] = ",".join(map(_code, later[:3]))
        if not steps and words.distance is not None and not page.routed:
            answer["mark"] = _ahead(words.distance)

    def _doubt(self, page: Page, note: dict[str, str], answer: dict[str, str]) -> None:
        """Drops a place that the passenger does not mean."""
        name = re.match(r"(another )?(House|Person)?", page.goal)
        if page.routed and name is not None and name[2]:
            note.clear()
            answer["goal"] = f"another {name[2]}" if f"another {name[2]}" in page.others else name[2]
        elif page.there:
            note.clear()
            answer["goal"] = "none"

    def _aim(
        self, page: Page, name: LandmarkName, words: ParsedText, note: dict[str, str], answer: dict[str, str]
    ) -> None:
        if "halt" in note and _name(page.goal) == name.label and words.distance is None:  # this is not the place yet
            note.clear()
            note["go"] = "1"
            answer.update(goal="none" if page.there else "keep", say="Which way should I go?")
            return
        streets = [f"{street.label} Street" for street in words.streets if isinstance(street, StreetName)]
        known = {
            label: street
            for label, street in page.places.items()
            if _name(label) == name.label and not (name in SAME_EVERYWHERE and label in page.visited)
        }
        fitting = [label for label, street in known.items() if street in streets]
        guided = page.off_map and _name(page.goal) == name.label
        if (fitting or (known and (not streets or name not in SAME_EVERYWHERE))) and not guided:
            label = (fitting or list(known))[0]
            if page.goal != label:
                note.clear()
                note["go"] = "1"
                answer.update(goal=label, say=f"Okay, to the {label}.")
            return
        label = f"another {name.label}" if name in SAME_EVERYWHERE and _is_on_map(page, name) else name.label
        if words.distance is not None and not page.routed:
            answer.update(goal=label if page.goal != label else "keep", mark=_ahead(words.distance))
            answer["say"] = answer["say"] or "Okay."
        elif page.goal != label:
            note.clear()
            note["go"], note["at"] = "1", streets[0] if streets else ""
            answer.update(goal=label, say="It is not on my map. Which way should I go?")

    def _stop(self, page: Page, note: dict[str, str], answer: dict[str, str]) -> None:
        _clear(note)
        note["halt"] = "1"
        answer["drive"] = "Stop" if "Stop" in page.drives else "none"

    def _obey(
        self, page: Page, step: PlanStep, words: ParsedText, note: dict[str, str], answer: dict[str, str]
    ) -> None:
        action = step.action
        if action in (StepAction.STOP, StepAction.WAIT):
            self._stop(page, note, answer)
            return
        answer["say"] = answer["say"] or "Okay."
        if action is StepAction.SPEED:
            _change_speed(page, step, words, note)
            return
        if action is StepAction.LIGHTS:
            label = "LightChange off" if step.change is StepChange.OFF else "LightChange on"
            answer["drive"] = label if label in page.drives else "none"
            return
        note.pop("halt", None)
        note["go"] = "1"
        if action is StepAction.TURN:
            for name in ("wish", "then", "hold", "past"):
                note.pop(name, None)
            note["turn"] = step.direction.value if step.direction in SIDES else "any"
            note["onto"], note["past"] = _street(step), _landmark_before(page, step)
            note["skip"] = str(step.ordinal - 1) if step.ordinal and step.ordinal > 1 else ""
        elif action is StepAction.U_TURN:
            note.pop("turn", None)
            note.pop("then", None)
            note["wish"] = "UTurn"
        elif action is StepAction.LANE:
            note["wish"] = f"LaneSwitch {'right' if Direction.RIGHT in (step.direction, step.side) else 'left'}"
        elif words.further or (step.distance is not None and not page.routed):
            answer["mark"] = _ahead(step.distance or 6.0)
        elif page.exits and page.exits[0][3] < 60 and not page.routed:
            note.pop("wish", None)
            note.update(turn="straight", onto="", skip="")

    # --- driving ----------------------------------------------------------------------------------------------------

    def _drive(self, page: Page, note: dict[str, str], answer: dict[str, str]) -> None:
        if answer["drive"] != "none":
            return
        _next_of_plan(page, note)
        label = self._route_step(page, note, answer)
        if not label and "halt" in note:
            if page.stopped and page.time - page.last_said > 12 and not page.heard:
                answer["say"] = answer["say"] or "Where should I go now?"
            return
        answer["drive"] = label or self._wish(page, note) or self._go(page, note) or "none"
        if answer["drive"] != "none":
            return
        note.pop("go", None)
        lost = page.car.startswith("waiting") and not page.routed and "turn" not in note
        if lost and page.time - page.last_said > 6:
            answer["say"] = answer["say"] or "Which way should I go?"
        self._set_speed(page, note, answer)

    def _route_step(self, page: Page, note: dict[str, str], answer: dict[str, str]) -> str:
        if not page.due or "turn" in note or "wish" in note or answer["goal"] != "keep":
            return ""
        label = re.match(r"(JTurn -?\d+|LaneSwitch \w+|\w+)", page.step)[0]  # type: ignore[index]
        if label not in page.drives:
            return ""
        if label == "Stop":
            note["halt"] = "1"
            note.pop("go", None)
        return label

    def _wish(self, page: Page, note: dict[str, str]) -> str:
        wish = note.get("wish")
        if wish and wish in page.drives:
            note.pop("wish")
            return wish
        if wish == "UTurn" and "LaneSwitch left" in page.drives and page.speed > 1:
            return "LaneSwitch left"
        if "turn" in note and page.exits and not page.prepared.startswith(("LaneSwitch", "UTurn")):
            return self._turn(page, note)
        return ""

    def _go(self, page: Page, note: dict[str, str]) -> str:
        starts = [label for label in ("Start", "LaneFollow") if page.stopped and label in page.drives]
        if starts:
            note.pop("go", None)
        return next(iter(starts), "")

    def _set_speed(self, page: Page, note: dict[str, str], answer: dict[str, str]) -> None:
        if page.time > float(note.get("until", 0)):
            note.pop("speed", None)
            note.pop("until", None)
        usual = SEARCH_SPEED if page.off_map and page.street == note.get("at") else USUAL_SPEED
        speed = int(note.get("speed", usual))
        if abs(page.cruise - speed) > 2:
            label = f"SpeedChange {'up' if page.cruise < speed else 'down'}"
            answer.update(drive=label if label in page.drives else "none", again="1")

    def _turn(self, page: Page, note: dict[str, str]) -> str:
        straight = [f"JTurn {angle}" for angle, way, _, _ in page.exits if way == "straight"]
        if note.get("skip"):
            if page.prepared:
                return ""
            note["skip"] = str(int(note["skip"]) - 1) if int(note["skip"]) > 1 else ""
            note["hold"] = "1"
            return next((label for label in straight if label in page.drives), "")
        if note.get("hold") and page.prepared:
            return ""
        note.pop("hold", None)
        fitting = [(angle, street) for angle, way, street, _ in page.exits if note["turn"] in (way, "any")]
        onto = [(angle, street) for angle, street in fitting if street == note.get("onto")]
        later = bool(note.get("onto")) and not onto and note["turn"] == "any"
        later = later or page.away.get(note.get("past", ""), 0.0) > page.exits[0][3] + 25.0
        chosen = [] if later else onto or fitting
        if not chosen:
            note["hold"] = "1"
            return next((label for label in straight if label in page.drives), "")
        canonical = {"left": 90, "right": -90, "straight": 0}.get(note["turn"], 0)
        angle = min(chosen, key=lambda each: abs(each[0] - canonical))[0]
        for name in ("turn", "onto", "skip", "hold", "past"):
            note.pop(name, None)
        label = f"JTurn {angle}"
        if label not in page.drives:
            return ""
        note["taken"] = f"{page.time:.0f}"
        return label


def _next_of_plan(page: Page, note: dict[str, str]) -> None:
    """Takes the next turn of a description once the one before is done, and drops a turn that is not possible."""
    waits = page.car.startswith("waiting")
    if waits and note.get("turn") and not any(way in (note["turn"], "straight") for _, way, _, _ in page.exits):
        _forget_turn(note)
    if "taken" in note and (not page.prepared and page.time - float(note["taken"]) > 2):
        note.pop("taken")
    if note.get("then") and "turn" not in note and "taken" not in note and "wish" not in note and not page.prepared:
        first, _, rest = note["then"].partition(",")
        way, _, street = first.partition("@")
        note.update(turn=way, onto=street, skip="", then=rest)


def _is_on_route(page: Page, step: PlanStep) -> bool:
    """Whether an instruction is the next step of the route that the prompt shows."""
    if step.action is StepAction.U_TURN:
        return "UTurn" in page.step
    if step.action is StepAction.LANE:
        return "LaneSwitch" in page.step
    return step.direction not in SIDES or f"({step.direction.value}," in page.step


def _landmark_before(page: Page, step: PlanStep) -> str:
    """The place on the map after which a turn is due."""
    if step.condition is None or step.condition.relation is not ConditionRelation.AFTER:
        return ""
    name = step.condition.place.landmark
    known = [label for label in page.places if name is not None and _name(label) == name.label]
    return min(known, key=lambda label: page.away[label], default="")


def _is_plain_turn(step: PlanStep) -> bool:
    """Whether a step is one at the next junction, or onto a street."""
    place = step.condition.place if step.condition is not None else None
    plain = place is None or place.landmark is None
    return plain and (
        step.action is StepAction.STRAIGHT or (step.action is StepAction.TURN and step.direction in SIDES)
    )


def _code(step: PlanStep) -> str:
    if step.action is StepAction.STRAIGHT or step.direction is None:
        return "straight"
    street = _street(step)
    return f"{step.direction.value}@{street}" if street else step.direction.value


def _street(step: PlanStep) -> str:
    street = step.condition.place.street if step.condition is not None else None
    return f"{street.label} Street" if street is not None and street is not StreetName.UNKNOWN else ""


def _told(words: ParsedText) -> tuple[PlanStep, ...]:
    """The step of a statement such as "we're turning left here"."""
    acts = [span.act for span in guess_spans(words.text) if span.act.move is DialogueMove.INSTRUCT]
    named = {action for act in acts for action in act.values(Slot.ACTION)}
    kinds = {
        ActionValue.J_TURN: StepAction.TURN,
        ActionValue.LANE_SWITCH: StepAction.LANE,
        ActionValue.U_TURN: StepAction.U_TURN,
        ActionValue.STOP: StepAction.STOP,
    }
    side = words.direction if words.direction in SIDES else None
    found = [kinds[action] for action in kinds if action in named]
    if len(found) != 1 or (side is None and found[0] in (StepAction.TURN, StepAction.LANE)):
        return ()
    return (PlanStep(action=found[0], direction=side),)


def _forget_turn(note: dict[str, str]) -> None:
    for name in ("turn", "onto", "skip", "hold", "then", "past"):
        note.pop(name, None)


def _clear(note: dict[str, str]) -> None:
    """Forgets all but the street of the place."""
    kept = note.get("at", "")
    note.clear()
    note["at"] = kept


def _slow(page: Page, note: dict[str, str], speed: int) -> None:
    note["speed"], note["until"] = str(speed), f"{page.time + SLOW_TIME:.0f}"


def _change_speed(page: Page, step: PlanStep, words: ParsedText, note: dict[str, str]) -> None:
    said = step.speed if step.speed is not None else words.speed
    wanted = said if said is not None else page.cruise + (10 if step.change is StepChange.FASTER else -15)
    _slow(page, note, min(max(5 * round(wanted / 5), 10), 60))


def _name(label: str) -> str:
    """Returns the name of a place that a prompt shows as "another House on Beal Street", say."""
    return label.removeprefix("another ").split(" on ")[0]


def _is_on_map(page: Page, name: LandmarkName) -> bool:
    return any(_name(label) == name.label for label in page.places)


def _ahead(metres: float) -> str:
    return f"{min((5, 10, 20, 30, 50, 80), key=lambda each: abs(each - metres))} m ahead"


def _reply(page: Page, act: DialogueAct) -> str:
    if act.move is DialogueMove.QUERY_W:
        return "I am on my way." if page.routed else "I need the way from you."
    return "Yes."


def answer_of(request: Mapping[str, Any]) -> dict[str, str]:
    """Returns the reader's answer to the body of a request."""
    content = request["messages"][1]["content"]
    return CoWizardReader()(content if isinstance(content, str) else content[0]["text"])
