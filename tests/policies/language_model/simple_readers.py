"""Rule programs that play participant and Ad-Wizard by reading prompts, and answers drawn from a schema."""

from __future__ import annotations

import random
import re

from dorothie_gym.policies.language_model.answer_schema import AnswerSchema, ChoiceField

LOST = re.compile(r"didn't|catch|afraid|don't|can't|where|which way|should I|lost|reached|arrived", re.IGNORECASE)
STANDSTILL = 12  # silence of a standing car after which the way is said again [s]
REPEAT = 9  # silence after which a turn that is near is said again [s]


def listed(prompt: str, title: str) -> list[str]:
    """Lines of a list in a prompt."""
    lines = prompt.split("\n")
    start = next((k for k, line in enumerate(lines) if line.startswith(title)), None)
    found: list[str] = []
    for line in lines[start + 1 :] if start is not None else []:
        if not line.startswith("- "):
            break
        found.append(line[2:])
    return found


def guide(prompt: str) -> dict[str, str]:
    """Plays the participant: names the place of the first open task, and says every step on the way there."""
    answer = {"guide": "keep", "say": "", "note": "", "again": "5"}
    open_tasks = [line for line in listed(prompt, "Your tasks") if line.endswith("can be done now")]
    if not open_tasks:
        return answer
    name, street = re.search(r"\(place: (\w+) on (.*?)\):", open_tasks[0]).groups()  # type: ignore[union-attr]
    labels = {line.partition(", on ")[0]: line for line in listed(prompt, "Places")}
    place = next(label for label in labels if label in (name, f"{name} on {street}"))
    current = re.search(r"You guide to: (.*)", prompt)[1]  # type: ignore[index]
    if current != place:
        return {**answer, "guide": place, "say": f"Please go to the {name} on {street}."}
    way = re.search(r"Way there: .*; (.*)", prompt)
    step = words_of(way[1].removeprefix("next: ")) if way else f"To the {name} on {street}."
    silence = time_of(prompt) - last_said(prompt)
    speed = int(re.search(r"Car: (\d+) km/h", prompt)[1])  # type: ignore[index]
    for event in listed(prompt, "Just now"):
        told = re.match(r"On the way: (?:next: )?(.*)", event)
        if told is not None:
            answer["say"] = words_of(told[1])
        elif event.startswith("The driver said") and (event.endswith('?"') or LOST.search(event)):
            answer["say"] = step
        elif event.startswith("The car has been standing"):
            answer["say"] = f"Please drive on. {step}"
        elif event.startswith("The way is blocked"):
            answer["say"] = f"The road is blocked. {step}"
    if not answer["say"] and ((speed == 0 and silence > STANDSTILL) or (is_due(way) and silence > REPEAT)):
        answer["say"] = f"To the {name} on {street}. {step}" if speed == 0 else step
    return answer


def time_of(prompt: str) -> int:
    minutes, seconds = re.search(r"Time: (\d+):(\d\d)", prompt).groups()  # type: ignore[union-attr]
    return 60 * int(minutes) + int(seconds)


def last_said(prompt: str) -> int:
    """Time of the own last words."""
    said = [re.match(r"(\d+):(\d\d) you:", line) for line in listed(prompt, "Conversation")]
    return max((60 * int(line[1]) + int(line[2]) for line in said if line is not None), default=0)


def is_due(way: re.Match[str] | None) -> bool:
    """Whether the next turn on the way is near."""
    found = re.search(r"(left|right|round).* in (\d+) m", way[1]) if way is not None else None
    return found is not None and int(found[2]) < 60


def words_of(step: str) -> str:
    if step.startswith("say stop"):
        return "Stop here!"
    if step.startswith("turn round"):
        return "Please make a U-turn."
    if step.startswith("change to the"):
        return f"Change to the {step.split()[3]} lane."
    if step.startswith("the place is near"):
        return "Slow down please."
    if step.startswith("the place is"):
        return "Go straight on."
    way, _, street = step.partition(" in ")[0], None, step.partition(", onto ")[2]
    if way == "straight on":
        return "Go straight on at the next junction."
    onto = f" onto {street}" if street and not street.startswith("an ") else ""
    return f"Turn {way} at the next junction{onto}."


class Interferer:
    """Plays the Ad-Wizard: makes each change that it is offered for the first time."""

    def __init__(self) -> None:
        self.made: list[str] = []

    def __call__(self, prompt: str) -> dict[str, str]:
        answer = {"change": "none", "message": "", "note": "", "again": "20"}
        offered = re.search(r"You can change: (.*)", prompt)[1].split(", ")  # type: ignore[index]
        for label in offered:
            kind = re.sub(r"\d+", "N", label)
            if label != "none" and kind not in self.made:
                self.made.append(kind)
                return {**answer, "change": label, "message": "Mind the road."}
        return answer


class Dice:
    """Answers with values drawn from the schema of each prompt."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)

    def draw(self, schema: AnswerSchema) -> dict[str, str]:
        words = ["turn", "left", "stop", "at", "the", "KFC", "why?", "yes", "I", "see", "slow", "down", "please"]
        return {
            field.name: self._random.choice(field.labels)
            if isinstance(field, ChoiceField)
            else " ".join(self._random.choices(words, k=self._random.randrange(6)))
            for field in schema.fields
        }
