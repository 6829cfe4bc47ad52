"""Who may import whom, as an ordered list: a module imports only from lower layers."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

APP = Path(__file__).parents[2] / "app"
LAYERS = [
    {"errors"},
    {"options"},
    {"scene", "gpu"},
    {"atlas"},
    {"projections"},
    {"solvers", "reference", "render", "metrics", "bake"},
    {"history", "picking", "opening", "stats"},
    {"loading"},
    {"session"},
    {"ui"},
    {"headless_ui", "console"},
    {"window", "info", "doctor", "bench"},
    {"headless"},
    {"cli"},
    {"__main__"},
]
LAYER = {name: i for i, layer in enumerate(LAYERS) for name in layer}
# packages of GL may be imported only here
GL = {"gpu", "window"}
FORBIDDEN = {("ui", "gpu"), ("render", "solvers"), ("bake", "solvers"), ("scene", "gpu"), ("gpu", "scene")}
FILES = sorted(APP.rglob("*.py"))


def imported(path: Path) -> set[str]:
    names: set[str] = set()
    for node in _statements(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            names |= {f"{node.module}.{alias.name}" for alias in node.names} if node.module == "app" else {node.module}
    return names


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """Every node except those that only a type checker sees."""
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    yield node
    for child in ast.iter_child_nodes(node):
        yield from _statements(child)


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(APP)))
def test_imports_only_from_lower_layers(path: Path) -> None:
    own = path.relative_to(APP).with_suffix("").parts[0]
    if own == "__init__":
        return
    assert own in LAYER, f"app/{own} has no layer: give it one here"
    for name in imported(path):
        top, *rest = name.split(".")
        if top in ("moderngl", "moderngl_window"):
            assert own in GL, f"{path}: {top} is imported only in {', '.join(sorted(GL))}"
        if top != "app" or not rest or rest[0] == own:
            continue
        assert (own, rest[0]) not in FORBIDDEN, f"{path} imports app.{rest[0]}"
        if rest[0] in LAYER:
            assert LAYER[rest[0]] < LAYER[own], f"{path}: {own} may not import app.{rest[0]}"
