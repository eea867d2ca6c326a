import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.dialogue import guess_act, guess_spans, word_act
from dorothie_gym.ontology import DialogueMove, Role, Slot, parse_act

sys.path.insert(0, str(Path(__file__).parent))
