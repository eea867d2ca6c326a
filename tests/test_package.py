from __future__ import annotations

import ast
import importlib
import json
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path
from typing import Any

import gymnasium as gym
import pettingzoo
import pytest

import dorothie_gym

SLOW = (
    "torch", "stable_baselines3", "sb3_contrib", "transformers", "pygame", "matplotlib", "highway_env", "filterpy",
    "numba", "scipy", "lxml", "rich", "typer",
)  # fmt: skip


def loaded_by(code: str) -> Any:
    """What a fresh interpreter prints as JSON after running the code."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_import_loads_nothing_slow() -> None:
    modules = loaded_by("import json, sys, dorothie_gym; print(json.dumps(sorted(sys.modules)))")
    assert not {name.partition(".")[0] for name in modules} & set(SLOW)
    ours = [name for name in modules if name.startswith("dorothie_gym")]
    assert ours == ["dorothie_gym", "dorothie_gym._registration", "dorothie_gym._startup", "dorothie_gym._version"]


def test_import_costs_little_more_than_gymnasium_and_pettingzoo() -> None:
    code = """
        import json, sys, time
        import gymnasium, pettingzoo
        before, start = set(sys.modules), time.process_time()
        import dorothie_gym
        print(json.dumps([time.process_time() - start, len(set(sys.modules) - before)]))
    """
    seconds, modules = loaded_by("\n".join(line.strip() for line in code.splitlines()))
    assert seconds < 0.1
    assert modules < 6


def test_names_are_found_when_used() -> None:
    for name in dorothie_gym.__all__:
        assert getattr(dorothie_gym, name) is not None
    assert set(dorothie_gym.__all__) <= set(dir(dorothie_gym))
    with pytest.raises(AttributeError, match="attribute Nonsense"):
        _ = dorothie_gym.Nonsense


def test_names_come_from_the_modules_that_the_stub_names() -> None:
    stub = ast.parse(Path(str(dorothie_gym.__file__)).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    assert sorted(alias.name for node in imports for alias in node.names) == sorted(dorothie_gym.__all__)
    for node in imports:
        module = importlib.import_module(f"dorothie_gym.{node.module}")
        for alias in node.names:
            assert alias.asname == alias.name, "a stub re-exports a name only as `X as X`"
            assert getattr(dorothie_gym, alias.name) is getattr(module, alias.name)


def test_environments_are_registered() -> None:
    ids = {name for name in gym.registry if name.startswith("dorothie_gym/")}
    names = ("Participant", "CoWizard", "AdWizard", "UfN", "RfN", "NfD", "Town", "Navigation", "Navigation-continuous")
    assert ids == {f"dorothie_gym/{name}-v0" for name in names}
    assert "dorothie_gym/DuoWizard-v0" in pettingzoo.parallel_registry
    assert "dorothie_gym/DuoWizard-v0" in pettingzoo.aec_registry


def test_pettingzoo_makes_both_forms() -> None:
    parallel = pettingzoo.make("parallel", "dorothie_gym/DuoWizard-v0", town="brookside", max_cycles=3)
    assert isinstance(parallel, dorothie_gym.DuoWizardEnv)
    assert parallel.max_cycles == 3
    turns = pettingzoo.make("aec", "dorothie_gym/DuoWizard-v0")
    turns.reset(seed=1)
    assert turns.agent_selection == "participant"


def test_gymnasium_makes_a_role_without_importing_the_package_first() -> None:
    env = gym.make("dorothie_gym:dorothie_gym/CoWizard-v0", town="brookside")
    assert env.unwrapped.role is dorothie_gym.Role.CO_WIZARD  # type: ignore[attr-defined]  # `gym.make` returns an `Env`


@pytest.mark.parametrize("target", ["wheel", "sdist"])
def test_distributions_contain_the_shipped_models(target: str, tmp_path: Path) -> None:
    pytest.importorskip("hatchling", reason="needs the backend of the build")
    pytest.importorskip("hatch_fancy_pypi_readme", reason="needs the plugin of the build")
    root = Path(__file__).parents[1]
    command = [sys.executable, "-m", "hatchling", "build", "--target", target, "--directory", str(tmp_path)]
    subprocess.run(command, cwd=root, check=True, capture_output=True, timeout=120)
    (built,) = tmp_path.iterdir()
    if target == "wheel":
        with zipfile.ZipFile(built) as archive:
            roots = {name.partition("/")[0].partition("-")[0] for name in archive.namelist()}
            assert roots == {"dorothie_gym", "dorothie_sessions.py"}  # the latter is the plugin of verifiers
            names = [*archive.namelist(), "dorothie_gym/agents/verifiers/plugin.py"]  # is there as dorothie_sessions.py
            contents = {name: archive.read(name) for name in names if "/data/pretrained/" in name}
    else:
        with tarfile.open(built) as archive:
            names = [name.partition("/")[2] for name in archive.getnames()]
            members = [member for member in archive.getmembers() if "/data/pretrained/" in member.name]
            contents = {member.name: archive.extractfile(member).read() for member in members}  # type: ignore[union-attr]  # files
    modules = {path.relative_to(root).as_posix() for path in (root / "dorothie_gym").rglob("*.py")}
    assert modules <= set(names)  # also of the folders that links of the root lead to
    shipped = root / "dorothie_gym" / "policies" / "data" / "pretrained"
    files = [path for path in shipped.rglob("*") if path.is_file()]
    assert len(files) == len(contents) >= 12
    for path in files:
        (found,) = (name for name in contents if name.endswith(path.relative_to(shipped.parent).as_posix()))
        assert contents[found] == path.read_bytes()


PACKAGE = Path(str(dorothie_gym.__file__)).parent


def module_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


LAZY_FACES = sorted(
    module_of(path)
    for path in PACKAGE.rglob("__init__.py")
    if path.parent != PACKAGE and "attach_stub" in path.read_text(encoding="utf-8")
)


@pytest.mark.parametrize("face", LAZY_FACES)
def test_each_name_of_a_lazy_face_is_found(face: str) -> None:
    module = importlib.import_module(face)
    for name in module.__all__:
        value = getattr(module, name)
        assert not isinstance(value, type(sys)), f"{face}.{name} is a module"


def test_modules_import_names_from_where_they_are_defined() -> None:
    """A face hides what a module depends on; what is meant to be lazy is used as `maps.load_town`."""
    through_faces = [
        f"{module_of(path)}:{node.lineno} imports {alias.name} from {node.module}"
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module in LAZY_FACES
        for alias in node.names
        if not list((PACKAGE.parent / str(node.module).replace(".", "/")).glob(f"{alias.name}.py"))
        and not (PACKAGE.parent / str(node.module).replace(".", "/") / alias.name).is_dir()
    ]
    assert through_faces == []


def test_importing_an_environment_loads_neither_pictures_nor_speech() -> None:
    modules = loaded_by(
        "import json, sys, dorothie_gym.envs.duo_wizard_v0; "
        "print(json.dumps([name for name in sys.modules if name.startswith('dorothie_gym.')]))"
    )
    faces = ("dorothie_gym.pictures.camera", "dorothie_gym.pictures")
    drawn = [name for name in modules if name.startswith("dorothie_gym.pictures.") and name not in faces]
    spoken = [name for name in modules if name.startswith(("dorothie_gym.speech", "dorothie_gym.support.audio"))]
    assert drawn + spoken == []
    assert not {"dorothie_gym.dialogue.nlg", "dorothie_gym.dialogue.nlu", "dorothie_gym.tasks.parsing"} & set(modules)
    assert not [name for name in modules if name.startswith(("dorothie_gym.maps.yaml", "dorothie_gym.maps.opendrive"))]
