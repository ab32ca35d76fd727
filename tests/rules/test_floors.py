"""Who may import whom: the table in docs/architecture.md against the imports themselves."""

import ast
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "thrustd"
ROW = re.compile(r"^\| (\d) \| ((?:`[\w.]+` ?)+)\|", re.MULTILINE)
PAGE = (PACKAGE.parent / "docs" / "architecture.md").read_text()
FLOORS = {int(number): set(re.findall(r"`([\w.]+)`", rooms)) for number, rooms in ROW.findall(PAGE)}
FLOOR = {room: number for number, rooms in FLOORS.items() for room in rooms}
PURE = {*FLOORS[0], *FLOORS[1], *FLOORS[2], "pipeline"}
IMPURE = {
    "time", "datetime", "random", "os", "pathlib", "io", "socket", "threading", "asyncio", "logging", "serial",
    "can", "mcap",
}  # fmt: skip
FILES = sorted(PACKAGE.rglob("*.py"))


def room(name: str) -> str:
    """The folder of a dotted name below `thrustd`; a folder inside one may have its own floor."""
    parts = name.split(".")
    inner = ".".join(parts[:2])
    return inner if inner in FLOOR else parts[0]


def module(path: Path) -> str:
    return ".".join(path.relative_to(PACKAGE).with_suffix("").parts)


def imports(path: Path) -> list[str]:
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names.append(node.module or "")
            names += [f"{node.module}.{alias.name}" for alias in node.names if node.module == "thrustd"]
    return names


def test_every_room_stands_on_a_floor():
    loose = {path.name for path in PACKAGE.glob("*.py")} - {"__init__.py", "__main__.py"}
    folders = {path.parent.name for path in PACKAGE.glob("*/*.py")}
    assert not loose and folders == {name for name in FLOOR if "." not in name}


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_go_down_only(path):
    here = room(module(path))
    for name in imports(path):
        there = room(name.removeprefix("thrustd."))
        if name.startswith("thrustd.") and here in FLOOR and there not in (here, "__version__"):
            assert FLOOR[there] < FLOOR[here], f"{here} imports {name}"


@pytest.mark.parametrize(
    "path", [p for p in FILES if room(module(p)) in PURE], ids=lambda path: str(path.relative_to(PACKAGE))
)
def test_low_floors_are_pure(path):
    for name in imports(path):
        assert name.split(".")[0] not in IMPURE, f"{path.name} imports {name}"
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in {"open", "eval", "exec", "__import__"}, f"{path.name} calls {node.func.id}"


def test_threads_live_in_sources_sinks_and_the_workbench():
    users = {room(module(path)) for path in FILES if "threading" in imports(path)}
    assert users <= {"sources", "sinks", "workbench", "onboard"}  # onboard: the stop flag only


def test_nothing_evaluates_or_unpickles():
    for path in FILES:
        names = {node.func.id for node in ast.walk(ast.parse(path.read_text()))
                 if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}  # fmt: skip
        assert not names & {"eval", "exec"}, path
        assert "pickle" not in imports(path), path
