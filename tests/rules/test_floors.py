"""Who may import whom (STYLE.md section 4), read from the imports themselves."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "thrustd"
FLOORS = {
    "types": 0, "errors": 0, "config": 0, "signals": 0, "compiled": 0, "columns": 0,
    "wire": 1, "sync": 1, "model": 1, "brochure": 1, "fusion": 1,
    "pipeline": 2, "intake": 2, "mount_route": 2, "mount_start": 2, "mount_step": 2, "fault_book": 2,
    "step_inputs": 2, "brochure_route": 2, "fault_status": 2, "snapshot": 2,
    "signature": 3, "whole_file": 3,
    "sources": 3, "sinks": 3,
    "loop": 4, "flight_means": 4, "flight_score": 4, "flight_picture": 4, "twin": 4, "records": 4, "installation": 4,
    "checkpoint": 4, "realtime": 4, "heartbeat": 4, "smoothed_flight": 4,
    "daemon": 5, "replay": 5, "identify": 5, "diagnose": 5,
    "workbench": 6, "fleet": 6,
    "cli": 7, "__main__": 8,
}  # fmt: skip
ALLOWED_SIDEWAYS = {
    ("config", "errors"),
    ("diagnose", "identify"),
    ("pipeline", "intake"),
    ("pipeline", "mount_route"),
    ("mount_route", "mount_start"),
    ("mount_route", "mount_step"),
    ("intake", "mount_route"),
    ("pipeline", "fault_book"),
    ("pipeline", "fault_status"),
    ("pipeline", "snapshot"),
    ("pipeline", "step_inputs"),
    ("pipeline", "brochure_route"),
    ("step_inputs", "mount_route"),
    ("twin", "records"),
    ("twin", "installation"),
    ("checkpoint", "installation"),
    ("heartbeat", "checkpoint"),
    ("flight_score", "flight_means"),
    ("flight_picture", "flight_score"),
    ("smoothed_flight", "flight_score"),
    ("smoothed_flight", "records"),
    ("sinks", "whole_file"),
}
FORBIDDEN_BELOW_3 = {
    "time", "datetime", "random", "os", "pathlib", "io", "socket", "threading", "asyncio", "logging", "serial",
    "can", "mcap",
}  # fmt: skip
FILES = sorted(PACKAGE.rglob("*.py"))


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


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


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_go_down_only(path):
    here = room(path)
    if here == "__init__":
        return
    for name in imports(path):
        parts = name.split(".")
        if parts[0] != "thrustd" or len(parts) == 1:
            continue
        there = parts[1]
        if there in (here, "__version__"):
            continue
        assert FLOORS[there] < FLOORS[here] or (here, there) in ALLOWED_SIDEWAYS, f"{here} imports {name}"


@pytest.mark.parametrize(
    "path", [p for p in FILES if FLOORS.get(room(p), 9) <= 2], ids=lambda path: str(path.relative_to(PACKAGE))
)
def test_low_floors_are_pure(path):
    for name in imports(path):
        assert name.split(".")[0] not in FORBIDDEN_BELOW_3, f"{path.name} imports {name}"
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in {"open", "eval", "exec", "__import__"}, f"{path.name} calls {node.func.id}"


def test_threads_live_in_sources_sinks_and_the_workbench():
    users = {room(path) for path in FILES if "threading" in imports(path)}
    assert users <= {"sources", "sinks", "workbench", "daemon"}  # daemon: the stop flag only


def test_nothing_evaluates_or_unpickles():
    for path in FILES:
        names = {node.func.id for node in ast.walk(ast.parse(path.read_text()))
                 if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}  # fmt: skip
        assert not names & {"eval", "exec"}, path
        assert "pickle" not in imports(path), path
