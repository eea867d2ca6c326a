"""Supervised tuning of a small network on recorded answers: `python -m tests.agents.tuning`.

It measures whether scores of text sessions rise with training, and says nothing about language models: a network of
some hundred thousand parameters, written here, learns the choices of the rule program from its recorded pages and
answers in towns for training. It then plays the same sessions in towns for tests as the rule program and the untrained
network. It chooses among the labels of a turn (`drive`, `goal`, `mark`, `again`), and says nothing.
"""

from __future__ import annotations

import json
import re
import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import mean, stdev
from typing import Annotated, Final

import torch
import typer
from torch import nn
from torch.nn.utils.rnn import pad_sequence

from dorothie_gym.agents import Split, TextSession, Turn
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.sim.config import WorldConfig
from tests.agents.players import reader_of, score
from tests.agents.reference_scores import TOWNS

FIELDS: Final = ("drive", "goal", "mark", "again")
WORDS: Final = 4096
"""Number of rows of the table of words, to which words are hashed."""

WIDTH: Final = 64
TRAIN_SEED, TEST_SEED = 30_000, 930_000
_WORD: Final = re.compile(r"-?\d+|[a-z]+")


@dataclass(frozen=True, kw_only=True)
class Example:
    """Recorded turn: its page and choices, and the index of the label that was chosen in each field."""

    page: str
    choices: Mapping[str, tuple[str, ...]]
    chosen: tuple[int, ...]


def words_of(text: str) -> list[int]:
    """Rows of the words and numbers of a text."""
    return [zlib.crc32(word.encode()) % WORDS for word in _WORD.findall(text.lower())]


def lines_of(page: str) -> list[list[int]]:
    """Words of each line of a page; items of a list have the words of its title before them."""
    lines, title = [], ""
    for line in page.splitlines():
        title = title if line.startswith("- ") else line.partition(":")[0]
        lines.append(words_of(f"{title} {title} {line}" if line.startswith("- ") else line))
    return [line or [0] for line in lines]


class LabelChooser(nn.Module):
    """Network that scores the labels of a field: lines and labels are means of words; labels attend to the lines."""

    def __init__(self) -> None:
        super().__init__()
        self.words = nn.EmbeddingBag(WORDS, WIDTH, mode="mean")
        self.fields = nn.Embedding(len(FIELDS), WIDTH)
        self.queries, self.keys = nn.Linear(WIDTH, WIDTH), nn.Linear(WIDTH, WIDTH)
        self.scores = nn.Sequential(nn.Linear(5 * WIDTH, 2 * WIDTH), nn.ReLU(), nn.Linear(2 * WIDTH, 1))

    def bags(self, texts: Sequence[Sequence[Sequence[int]]]) -> torch.Tensor:
        """Vectors of texts (n, most, WIDTH), zero where there are fewer."""
        flat = [words for text in texts for words in text]
        offsets = torch.tensor([0, *[len(words) for words in flat]]).cumsum(0)[:-1]
        vectors = self.words(torch.tensor([word for words in flat for word in words]), offsets)
        return pad_sequence(list(vectors.split([len(text) for text in texts])), batch_first=True)

    def forward(self, pages: torch.Tensor, field: int, labels: Sequence[Sequence[str]]) -> torch.Tensor:
        """Logits of the labels of a field (n, most); minus infinity where there are fewer.

        Args:
            pages: vectors of the lines of pages (n, lines, WIDTH).
            field: index of the field.
            labels: labels of each turn.
        """
        kind = self.fields(torch.tensor(field))
        named = self.bags([[words_of(label) or [0] for label in each] for each in labels])
        read = self._read(pages, named + kind)
        whole = self._read(pages, kind.expand(len(labels), 1, -1)).expand_as(named)
        logits = self.scores(torch.cat([named, read, named * read, whole, kind.expand_as(named)], -1)).squeeze(-1)
        missing = pad_sequence([torch.ones(len(each)) for each in labels], batch_first=True) == 0
        return logits.masked_fill(missing, -torch.inf)

    def _read(self, pages: torch.Tensor, asked: torch.Tensor) -> torch.Tensor:
        """Attends to the lines of pages from vectors (n, most, WIDTH)."""
        fit = self.queries(asked) @ self.keys(pages).transpose(1, 2)
        fit = fit.masked_fill((pages == 0).all(-1)[:, None], -torch.inf)
        return (fit / WIDTH**0.5).softmax(-1) @ pages


def recorded(session: TextSession, seed: int) -> list[Example]:
    """Pages and answers of the rule program in a session."""
    found: list[Example] = []
    reader, turn = reader_of("co_wizard"), session.reset(seed)
    while not turn.done:
        answer = reader(turn.page)
        chosen = tuple(turn.choices[name].index(answer[name]) for name in FIELDS)
        found.append(Example(page=turn.page, choices=turn.choices, chosen=chosen))
        turn = session.answer(answer)
    return found


def tuned(examples: Sequence[Example], epochs: int, seed: int = 0) -> LabelChooser:
    """A network that has learned the recorded choices by maximum likelihood; no epochs leave it untrained."""
    torch.manual_seed(seed)
    model, pages = LabelChooser(), [lines_of(each.page) for each in examples]
    optimiser = torch.optim.Adam(model.parameters(), lr=2e-3)
    for _ in range(epochs):
        for batch in torch.randperm(len(examples)).split(32):
            rows = batch.tolist()
            vectors = model.bags([pages[k] for k in rows])
            loss = torch.zeros(())
            for number, name in enumerate(FIELDS):
                logits = model(vectors, number, [examples[k].choices[name] for k in rows])
                target = torch.tensor([examples[k].chosen[number] for k in rows])
                loss = loss + nn.functional.cross_entropy(logits, target)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
    return model


def player_of(model: LabelChooser) -> Callable[[Turn], Mapping[str, str]]:
    """Player that takes the label of each field with the highest logit."""

    @torch.no_grad()
    def choose(turn: Turn) -> Mapping[str, str]:
        vectors = model.bags([lines_of(turn.page)])
        return {
            name: turn.choices[name][int(model(vectors, number, [turn.choices[name]]).argmax())]
            for number, name in enumerate(FIELDS)
        }

    return choose


def sessions_of(split: Split, first_seed: int, count: int) -> list[tuple[TextSession, int]]:
    """Sessions of two minutes with two errands in small towns without traffic, and their seeds; towns take turns."""
    config = EnvConfig(max_seconds=120.0, stops=(2, 2), world=WorldConfig(vehicles=0, pedestrians=0))
    towns = [TextSession(town=town, config=config, partners={"ad_wizard": "silent"}) for town in TOWNS[split]]
    return [(towns[k % len(towns)], first_seed + k) for k in range(count)]


def outcomes(player: Callable[[Turn], Mapping[str, str]], played: Sequence[tuple[TextSession, int]]) -> list[float]:
    """Scores of a player."""
    return [score(session, player, seed).score for session, seed in played]


def main(
    sessions: Annotated[str, typer.Option(help="numbers of recorded sessions, separated by commas")] = "0,10,40,160",
    tests: Annotated[int, typer.Option(min=2, help="number of sessions that are played in towns for tests")] = 24,
    epochs: Annotated[int, typer.Option(min=1, help="passes over the recorded turns")] = 20,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON and nothing else")] = False,
) -> None:
    """Prints the mean score of the network after each number of sessions, and that of the rule program."""
    torch.set_num_threads(1)
    counts = [int(each) for each in sessions.split(",")]
    played = sessions_of(Split.TEST, TEST_SEED, tests)
    examples = [recorded(session, seed) for session, seed in sessions_of(Split.TRAIN, TRAIN_SEED, max(counts))]
    rows = []
    for count in counts:
        known = [example for each in examples[:count] for example in each]
        begun = time.process_time()
        model = tuned(known, epochs if known else 0)
        spent = time.process_time() - begun
        scores = outcomes(player_of(model), played)
        rows.append({"sessions": count, "turns": len(known), "seconds": round(spent), "scores": scores})
    reader = reader_of("co_wizard")
    scores = outcomes(lambda turn: reader(turn.page), played)
    rows.append({"sessions": None, "turns": None, "seconds": None, "scores": scores})
    if as_json:
        print(json.dumps(rows))
        return
    size = sum(each.numel() for each in LabelChooser().parameters())
    print(f"Network of {size:,} parameters; {tests} sessions of two minutes in towns for tests")
    for row in rows:
        name = "rule program" if row["sessions"] is None else f"tuned on {row['sessions']} sessions"
        error = stdev(row["scores"]) / len(row["scores"]) ** 0.5
        print(f"{name}: mean score {mean(row['scores']):.3f} (standard error {error:.3f}), {row['turns']} turns, "
              f"{row['seconds']} s of training")  # fmt: skip


if __name__ == "__main__":
    typer.run(main)
