"""Practice of the learned Co-Wizard."""

from __future__ import annotations

from dorothie_gym.baselines.roles.co_wizard.demonstrations import CoWizardTraining, practise
from dorothie_gym.baselines.roles.co_wizard.examples import CoWizardExamples, Example
from dorothie_gym.baselines.roles.co_wizard.files import FILES
from dorothie_gym.baselines.roles.learned_role.dagger_sessions import PracticeSession
from dorothie_gym.baselines.roles.learned_role.examples import forms_in
from dorothie_gym.policies.pretrained import pretrained_folder
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine

SEEDS = (3, 4, 5)


def test_sessions_practised_together_give_the_examples_of_each_alone(tmp_path) -> None:
    network, page = FILES.load(pretrained_folder("pretrained:co-wizard"))
    settings = CoWizardTraining(corpus=tmp_path, share=0.8, talking=0.7)
    found: dict[tuple[str, int], list[Example]] = {(way, seed): [] for way in ("together", "alone") for seed in SEEDS}

    def session(way: str, seed: int) -> PracticeSession[Example]:
        engine = SessionEngine("brookside", config=EnvConfig(max_seconds=20.0, observe_acts=seed % 2 == 1))
        return PracticeSession(engine=engine, seed=seed, on_example=found[way, seed].append)

    practise(network, page.vocabulary, [session("together", seed) for seed in SEEDS], settings)
    for seed in reversed(SEEDS):
        practise(network, page.vocabulary, [session("alone", seed)], settings)
        forms = forms_in(form for one in found["alone", seed] for form in one.remarks)
        for way in ("together", "alone"):
            CoWizardExamples.of(found[way, seed], forms).write(tmp_path / way, forms)
        assert len(found["alone", seed]) > 10
        assert (tmp_path / "together").read_bytes() == (tmp_path / "alone").read_bytes()
