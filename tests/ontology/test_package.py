"""Public names and imports of the package."""

import subprocess
import sys

import dorothie_gym.ontology as ontology


def test_every_exported_name_exists() -> None:
    assert [name for name in ontology.__all__ if not hasattr(ontology, name)] == []


def test_import_loads_standard_library_only() -> None:
    code = (
        "import dorothie_gym, sys; before = set(sys.modules); import dorothie_gym.ontology\n"
        "roots = {name.split('.')[0] for name in set(sys.modules) - before}\n"
        "print(sorted(roots - set(sys.stdlib_module_names) - {'dorothie_gym'}))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_sets_of_slot_values_print_alike_in_every_process() -> None:
    code = (
        "from dorothie_gym.ontology import DialogueAct, DialogueMove, LABELS\n"
        "print(DialogueAct.of(DialogueMove.CHECK, *LABELS[::5]))"
    )
    outputs = {
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={"PYTHONHASHSEED": seed}
        ).stdout
        for seed in ("1", "2")
    }
    assert len(outputs) == 1
