"""Random acts and wordings for the tests of talk."""

import numpy as np

from dorothie_gym.dialogue import Direction, Wording
from dorothie_gym.ontology import SLOT_VALUES, DialogueAct, DialogueMove, LandmarkName, Slot

SHARES = {Slot.ACTION: 0.4, Slot.LANDMARK: 0.4, Slot.STREET: 0.25, Slot.OBJECT: 0.12, Slot.STATUS: 0.15}


def random_act(rng: np.random.Generator) -> DialogueAct:
    """Any move; up to two values in any of the slots. Irrelevant talk carries none."""
    move = DialogueMove(int(rng.integers(len(DialogueMove))))
    values = []
    for slot, share in SHARES.items():
        if move is not DialogueMove.IRRELEVANT and rng.random() < share:
            values += [SLOT_VALUES[slot][int(rng.integers(len(SLOT_VALUES[slot])))] for _ in range(rng.integers(1, 3))]
    return DialogueAct.of(move, *values)


def random_wording(rng: np.random.Generator) -> Wording:
    return Wording(
        direction=list(Direction)[int(rng.integers(4))] if rng.random() < 0.5 else None,
        ordinal=int(rng.integers(1, 10)) if rng.random() < 0.2 else None,
        faster=bool(rng.random() < 0.5) if rng.random() < 0.7 else None,
        lights=bool(rng.random() < 0.5) if rng.random() < 0.7 else None,
        speed=float(rng.integers(5, 90)) if rng.random() < 0.2 else None,
        distance=float(rng.integers(5, 300)) if rng.random() < 0.1 else None,
        here=bool(rng.random() < 0.1),
        past=list(LandmarkName)[int(rng.integers(1, 11))] if rng.random() < 0.1 else None,
    )
