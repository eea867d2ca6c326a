"""Kills the server of a study again and again while people take part and withdraw, and looks at what it leaves.

`python -m tests.studies.killing --times 50 --seed 7` prints what was promised and kept, as JSON; fails where something
that was acknowledged is lost, or something that was erased is left.
"""

from __future__ import annotations

import argparse
import http.client
import json
import random
import signal
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from websockets.exceptions import ConnectionClosed

from dorothie_gym.studies.export import export_study
from dorothie_gym.studies.stages import Stage
from tests.studies.content import SOLO, write_study
from tests.studies.serving import Client
from tests.studies.test_server import remains
from tests.test_cli_study import running

CONTENT = {
    **SOLO,
    "tutorial": None,
    "session": {"max_seconds": 300.0, "pictures": False},
    "absence": {"seconds": 600.0, "then": "wait"},
    "questionnaires": {"before": [{"id": "word", "kind": "text", "text": "A word?"}]},
}

LOST = OSError, http.client.HTTPException, EOFError, ConnectionClosed, AssertionError
"""Errors of people whose server has died; a refusal is an `AssertionError`, and is looked at by `check`."""

STEPS = Stage.CONSENT, Stage.BEFORE, Stage.INSTRUCTIONS, Stage.LOBBY, Stage.SESSION

LEAVING = Stage.INSTRUCTIONS, Stage.LOBBY, Stage.SESSION, None
"""Stages at which people withdraw, all of whom have answered."""


@dataclass
class Person:
    """Person and what the server has acknowledged.

    Attributes:
        client: the browser.
        word: what the person answers and says, which nobody else does.
        withdraws: stage at which the person withdraws; None for one who stays.
        stage: stage that was shown last.
        answered: whether the answer was acknowledged.
        gone: whether the withdrawal was.
        asked: whether it was asked for.
    """

    client: Client
    word: str
    withdraws: Stage | None
    stage: Stage | None = None
    answered: bool = False
    gone: bool = False
    asked: bool = False

    def go(self) -> None:
        """Goes as far as the server lives."""
        try:
            if self.stage is None:
                self._do("join", {"parameters": {"PROLIFIC_PID": f"platform-{self.word}"}, "visit": self.word * 3})
            while self.stage is not Stage.SESSION:
                if self.stage is self.withdraws:
                    return self._withdraw()
                self._step()
            with self.client.sit() as seat:
                self.client.say(seat, f"{self.word}, please.")
                if self.withdraws is not None:
                    self._withdraw()
        except LOST:
            return

    def _withdraw(self) -> None:
        self.asked = True
        if self.client.post("withdraw", {"sure": True}) == 200:
            self.gone = True

    def _step(self) -> None:
        if self.stage is Stage.CONSENT:
            self._do("consent", {"agreed": [True, True]})
        elif self.stage is Stage.BEFORE:
            self._do("answers", {"stage": "before", "answers": {"word": self.word}})
            self.answered = True
        elif self.stage is Stage.INSTRUCTIONS:
            self._do("proceed", {"stage": "instructions"})
        else:
            self._do("news", {"have": self.client.tag})

    def _do(self, name: str, body: object) -> None:
        self.client.do(name, body)
        self.stage = Stage(self.client.stage)

    def check(self, port: int) -> None:
        """Looks at the next server whether it has kept what was acknowledged."""
        self.client.port, self.client.tag = port, ""
        if self.stage is None:
            return
        status = self.client.post("news")
        if self.gone or (self.asked and status == 401):  # done, though its answer was lost
            assert status == 401, (self.word, status)
            self.gone = True
            return
        assert status == 200, (self.word, self.stage, status, self.client.answer)
        shown = Stage(self.client.stage)
        assert STEPS.index(shown) >= STEPS.index(self.stage), (self.word, self.stage, shown)
        self.stage = shown


def kill_again_and_again(folder: Path, *, times: int, seed: int, longest: float = 5.0) -> dict[str, int]:
    """Lets people take part in a study whose server is killed at random moments.

    Args:
        folder: folder of the study.
        times: number of kills.
        seed: seed of the moments and people.
        longest: longest life of a server after its start [s].

    Returns:
        Numbers of kills, people, withdrawals and answers that were acknowledged.
    """
    drawn, people = random.Random(seed), list[Person]()
    file, data = write_study(folder, CONTENT), folder / "data"
    for round_ in range(times + 1):
        with running(file, data) as (server, port):
            for person in people:
                person.check(port)
            _check_files(data, people)
            if round_ == times:
                break
            people += [Person(Client(port), f"Word{seed}x{len(people) + k}x", drawn.choice(LEAVING)) for k in range(3)]
            here = [person for person in people if not person.gone][-6:]
            threads = [threading.Thread(target=person.go) for person in here]
            for thread in threads:
                thread.start()
            time.sleep(drawn.uniform(0.1, longest))
            server.send_signal(signal.SIGKILL)
            server.wait(10)
            for thread in threads:
                thread.join(60.0)
    export_study(data, folder / "tables")
    answers = (folder / "tables" / "answers.csv").read_text(encoding="utf-8")
    for person in people:
        if person.gone:
            assert person.word not in answers
        elif person.answered:
            assert person.word in answers, person.word
    return {
        "kills": times, "people": len(people), "withdrawn": sum(person.gone for person in people),
        "answers": sum(person.answered for person in people),
    }  # fmt: skip


def _check_files(data: Path, people: list[Person]) -> None:
    for person in people:
        if person.gone:
            left = remains(data, person.word)
            assert left == [], (person.word, left)


def main() -> None:
    """Kills as often as the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(kill_again_and_again(Path(folder), times=asked.times, seed=asked.seed)))


if __name__ == "__main__":
    main()
