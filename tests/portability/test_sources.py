"""What a session depends on uses no function whose last bit the C library, numpy or BLAS chooses by the processor."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import dorothie_gym

PACKAGE = Path(dorothie_gym.__file__).parent

PORTABLE = (
    "agents", "archive", "dialogue", "envs", "evaluation/closed_loop", "evaluation/rollout", "maps", "ontology",
    "pictures", "policies", "session", "sim", "tasks",
)  # fmt: skip
"""Packages that decide about sessions, or about what a camera sees of them."""

EXCEPTIONS = {
    "maps/lint": "reports faults of a map; no session reads it",
    "pictures/views/sprites.py": "draws people's pictures",
    "sim/town_observations.py": "highway-env's own observations",
}

FUNCTIONS = {
    "acos", "acosh", "arccos", "arccosh", "arcsin", "arcsinh", "arctan", "arctan2", "arctanh", "asin", "asinh", "atan",
    "atan2", "atanh", "cbrt", "cos", "cosh", "dist", "dot", "erf", "erfc", "exp", "exp2", "expm1", "float_power",
    "gamma", "geomspace", "hypot", "inner", "lgamma", "log", "log10", "log1p", "log2", "logaddexp", "logspace",
    "matmul", "pow", "power", "sin", "sinc", "sinh", "tan", "tanh", "tensordot", "vdot",
}  # fmt: skip
LINEAR_ALGEBRA = {"det", "eig", "eigh", "inv", "lstsq", "pinv", "solve", "svd"}
UNSTABLE = {"argsort", "argpartition"}


def files() -> list[Path]:
    assert all((PACKAGE / name).is_dir() for name in PORTABLE)
    found = [file for name in PORTABLE for file in sorted((PACKAGE / name).rglob("*.py"))]
    return [file for file in found if not any(str(file.relative_to(PACKAGE)).startswith(each) for each in EXCEPTIONS)]


def faults(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            owner = ast.unparse(node.value)
            if owner in ("math", "np") and node.attr in FUNCTIONS:
                yield f"{node.lineno}: {owner}.{node.attr}; use portable_math or portable_arrays"
            if owner == "np.linalg" and node.attr in LINEAR_ALGEBRA:
                yield f"{node.lineno}: np.linalg.{node.attr}"
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
            yield f"{node.lineno}: @; use portable_arrays.matmul or dot"
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow) and not _is_exact(node):
            yield f"{node.lineno}: {ast.unparse(node)}; use a product or portable_math.power"
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in UNSTABLE:
            if not any(key.arg == "kind" for key in node.keywords):
                yield f"{node.lineno}: {node.func.attr} without kind='stable': the order of equal values differs"


def _is_exact(power: ast.BinOp) -> bool:
    """Returns whether a power is one of 2 or 10 (exact), or a square, which numpy and compiled code multiply."""
    base, exponent = ast.unparse(power.left), ast.unparse(power.right)
    return base in ("2", "2.0") or exponent == "2"


@pytest.mark.parametrize("package", PORTABLE)
def test_sessions_use_portable_functions(package: str) -> None:
    found = [
        f"{file.relative_to(PACKAGE)}:{fault}"
        for file in files()
        if file.relative_to(PACKAGE).parts[0] == package
        for fault in faults(ast.parse(file.read_text()))
    ]
    assert found == []


def test_exceptions_exist() -> None:
    assert all((PACKAGE / name).exists() for name in EXCEPTIONS)


@pytest.mark.parametrize(
    "line", ["np.arctan2(y, x)", "math.sin(x)", "a @ b", "np.linalg.inv(a)", "x ** 0.5", "np.argsort(x)", "x ** y"]
)
def test_unportable_lines_are_found(line: str) -> None:
    assert list(faults(ast.parse(line)))
