"""Co-Wizard that understands, speaks and drives by the predictions of a benchmark model."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.archive.visibility import Task
from dorothie_gym.baselines.benchmark_co_wizard.action_feasibility import FeasibleAction, feasible_action
from dorothie_gym.baselines.benchmark_co_wizard.decision_trigger import TriggerState
from dorothie_gym.baselines.benchmark_co_wizard.history import History, HistoryTracker
from dorothie_gym.dialogue.conversation import Span
from dorothie_gym.dialogue.dialogue_act_classifier import guess_act, guess_spans
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.dialogue.speaker_style import draw_style
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS, PhysicalAction
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import IN_VIEW
from dorothie_gym.policies.policy import Policy
from dorothie_gym.policies.route_progress import default_lane_distance
from dorothie_gym.policies.speech import SpeechState, remark
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH
from dorothie_gym.session.spaces.actions import ActionDict, CoWizardAction, Physical
from dorothie_gym.session.spaces.observations import ObservationMapping, heard_acts
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.baselines.benchmark_co_wizard.inference import BenchmarkModel, TownModel
    from dorothie_gym.baselines.point_tensors import Predicted
    from dorothie_gym.session.spaces.fields import SpaceLimits

_DIRECTION_VALUES: Final = (ActionValue.J_TURN, ActionValue.LANE_SWITCH)
"""Slot values whose wording contains a direction."""

_UNSAID: Final = Span("-", DialogueAct(DialogueMove.IRRELEVANT))
_UNDONE: Final = Physical(action=PhysicalAction.STOP)
"""Placeholders of the next act and the next action at a point; no point shows its own label."""


@dataclass(frozen=True, kw_only=True)
class BenchmarkPolicyState:
    """State of the policy.

    Attributes:
        seed: seed of all random numbers.
        town: the map.
        voice: state of its own speech.
        count: number of decisions so far.
        following: tracker of the history, None before the first observation.
        watch: state of the decision triggers.
    """

    seed: int
    town: Town
    voice: SpeechState
    count: int = 0
    following: HistoryTracker | None = None
    watch: TriggerState = field(default_factory=TriggerState)


class BenchmarkCoWizard(Policy[BenchmarkPolicyState]):
    """Co-Wizard that acts on the predictions of a model trained on recorded points.

    After each utterance of the participant it predicts the act (UfN, unless acts are observed), answers (RfN) and
    drives (NfD); before a junction without a planned turn it speaks and drives; when a hazard begins or ends, and where
    it has to stop for the last-named place, it drives. Between decisions the car follows its lane.
    """

    def __init__(self, trained: BenchmarkModel, limits: SpaceLimits | None = None) -> None:
        """Prepares the policy.

        Args:
            trained: the model.
            limits: sizes of the spaces.
        """
        super().__init__(Role.CO_WIZARD, limits)
        self._trained = trained

    def initial_state(self, seed: int, town: Town) -> BenchmarkPolicyState:
        """Returns the state before the first observation."""
        style = draw_style(Role.CO_WIZARD, np.random.default_rng((seed, 0)))
        return BenchmarkPolicyState(seed=seed, town=town, voice=SpeechState(role=Role.CO_WIZARD, style=style))

    def step(
        self, observation: ObservationMapping, state: BenchmarkPolicyState
    ) -> tuple[ActionDict, BenchmarkPolicyState]:
        """Updates the history, queries the model if a decision is due, and returns utterance and action."""
        town, count = state.town, state.count + 1
        view = CoWizardView.read(observation, town)
        before = state.following or HistoryTracker(history=History.begin(observation, town, self._trained.config))
        acts = heard_acts(observation, Role.PARTICIPANT)
        heard = spans_of(str(observation[f"{Role.PARTICIPANT}_text"]), acts, _last_move(state.voice))
        model, voice = self._trained.in_town(town), state.voice
        if heard:
            if acts is None:
                heard = _understood(model, before.observed(view, town, heard).history, heard)
            voice = voice.heard_other(view.time, [span.act for span in heard])
        following = before.observed(view, town, heard)
        occasion, watch = state.watch.look(view, bool(heard), _way_to_place(following.history, view, town))
        waits = view.motion is Motion.WAITING and not heard
        deed = _drive(model, following.history, view, town, waits) if occasion.drives else FeasibleAction(physical=None)
        if occasion.speaks and voice.idle:
            voice = _answer(model, following.history, voice, deed)
        rng = np.random.default_rng((state.seed, count))
        speech, voice = voice.speak(view.time, view.speaking, rng, other_speaking=view.other_speaking)
        following = following.acted(speech, deed.physical, view, self.limits.spans)
        action = CoWizardAction(speech=speech, physical=deed.physical).encode(self.limits)
        return action, replace(state, voice=voice, count=count, following=following, watch=watch)


def _last_move(voice: SpeechState) -> DialogueMove | None:
    return voice.last.act.move if voice.last is not None else None


def _way_to_place(history: History, view: CoWizardView, town: Town) -> float | None:
    """Returns the driving distance to the last-named place [m]; None if it is not near, or not on the map."""
    name = history.landmark
    named = next((landmark for landmark in view.landmarks if landmark.name.label == name), None)
    return None if named is None else default_lane_distance(town, view.here, named.place, IN_VIEW)


def _understood(model: TownModel, history: History, heard: tuple[Span, ...]) -> tuple[Span, ...]:
    """Returns the spans of the participant's last utterance with the acts that the model predicts."""
    known: tuple[Span, ...] = ()
    for k, span in enumerate(heard):
        predicted = model.answer(history, Task.UFN, last=len(heard) - k)
        known = (*known, Span(span.text, _act(predicted)))
        history = history.corrected((*known, *heard[k + 1 :]))
    return known


def _answer(model: TownModel, history: History, voice: SpeechState, deed: FeasibleAction) -> SpeechState:
    """Returns the speech state with the predicted act, worded by the grammar."""
    act = _act(model.answer(history.said(Role.CO_WIZARD, (_UNSAID,), history.frame + FRAMES_PER_TENTH), Task.RFN))
    direction = deed.direction if any(value in _DIRECTION_VALUES for value in act.slots) else None
    return voice.plan(remark(act.move, *act.ordered, wording=Wording(direction=direction)))


def _drive(model: TownModel, history: History, view: CoWizardView, town: Town, waits: bool) -> FeasibleAction:
    """Returns the most likely feasible action.

    Args:
        model: the model.
        history: the history.
        view: the observation.
        town: the map.
        waits: whether the car waits for a turn, where stopping has no effect.
    """
    asked = history.done(_UNDONE, history.frame + FRAMES_PER_TENTH)
    allowed = [not waits or action is not PhysicalAction.STOP for action in NAVIGATION_ACTIONS]
    for predicted in model.decisions(asked, allowed):
        action = NAVIGATION_ACTIONS[int(predicted.action)]
        deed = feasible_action(action, float(predicted.angle), view, town)
        if deed is not None:
            return deed
    return FeasibleAction(physical=None)


def _act(predicted: Predicted) -> DialogueAct:
    values = [value for value, present in zip(LABELS, predicted.slots[0].tolist(), strict=True) if present]
    return DialogueAct.of(DialogueMove(int(predicted.move)), *values)


# --- Spans of a heard utterance, with or without known acts -----------------------------------------------------------

_CLAUSE_END: Final = re.compile(r"(?<=[,.?!]) ")

_MAX_CLAUSES: Final = 8
"""Maximum number of clauses; the last one contains the rest of a longer utterance."""


def spans_of(text: str, acts: Sequence[DialogueAct] | None, after: DialogueMove | None = None) -> tuple[Span, ...]:
    """Returns the spans of an utterance.

    If the acts are known, the words are split at ends of clauses so that the rule-based act classifier agrees
    with them best; otherwise that classifier splits the words and predicts the acts.

    Args:
        text: the words; blank for no utterance.
        acts: the acts in order; None if they are not known.
        after: move of the listener's last utterance, for the classifier.
    """
    if acts is None:
        return guess_spans(text, after)
    words = text.split()
    if not words or not acts:
        return ()
    if len(acts) == 1:
        return (Span(text, acts[0]),)
    clauses = _CLAUSE_END.split(text)
    clauses = clauses if len(clauses) >= len(acts) else words
    clauses = (
        [*clauses[: _MAX_CLAUSES - 1], " ".join(clauses[_MAX_CLAUSES - 1 :])]
        if len(clauses) > _MAX_CLAUSES
        else clauses
    )
    shared = list(acts)[: len(clauses)]
    best = max(_partings(clauses, len(shared)), key=lambda pieces: _fit(pieces, shared))
    return tuple(Span(piece, act) for piece, act in zip(best, shared, strict=True))


def _partings(clauses: Sequence[str], count: int) -> Iterator[tuple[str, ...]]:
    """Yields every grouping of clauses into a number of pieces, those with long first pieces first."""
    for cuts in reversed(list(itertools.combinations(range(1, len(clauses)), count - 1))):
        ends = (0, *cuts, len(clauses))
        yield tuple(" ".join(clauses[start:end]) for start, end in itertools.pairwise(ends))


def _fit(pieces: Sequence[str], acts: Sequence[DialogueAct]) -> tuple[int, int]:
    """Returns the numbers of moves and of slot sets that the classifier predicts correctly."""
    guessed = [_guess(piece) for piece in pieces]
    moves = sum(guess.move is act.move for guess, act in zip(guessed, acts, strict=True))
    return moves, sum(guess.slots == act.slots for guess, act in zip(guessed, acts, strict=True))


@lru_cache(maxsize=1024)
def _guess(piece: str) -> DialogueAct:
    return guess_act(piece)
