"""What stands in the package is used by the package: not by tests and benchmarks alone."""

import ast
import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILES = sorted((ROOT / "thrustd").rglob("*.py"))
SAID_ELSEWHERE = (ROOT / "pyproject.toml").read_text() + (ROOT / "thrustd" / "api" / "__init__.py").read_text()
OTHERS_CALL = {"_repr_html_", "_repr_png_", "_recv_internal", "on_start", "on_end"}  # a notebook, python-can, numba
WORDS = Counter(re.findall(r"\w+", "".join(path.read_text() for path in FILES) + SAID_ELSEWHERE))


def defined(path):
    """Names of functions, classes and methods of a file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)) and not node.name.startswith("__"):
            yield node.name


def test_every_function_and_class_is_named_a_second_time():
    alone = {f"{path.relative_to(ROOT)}: {name}" for path in FILES for name in defined(path) if WORDS[name] < 2}
    alone = {words for words in alone if not words.split(": ")[1].startswith("visit_")}  # ast calls these
    assert not {words for words in alone if words.split(": ")[1] not in OTHERS_CALL}


def imported(path):
    """What a file may take from the package, as dotted names."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (node.module, *(f"{node.module}.{alias.name}" for alias in node.names))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from re.findall(r"[\w.]+", node.value)


def test_every_module_is_imported_by_another():
    used = {name for path in FILES for name in imported(path)} | set(re.findall(r"[\w.]+", SAID_ELSEWHERE))
    for path in FILES:
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        registry = name.startswith("thrustd.model.effects.")  # the folder is
        task = name.startswith("thrustd.workbench.") and path.stem in used  # its worker imports by name
        assert path.stem in ("__init__", "__main__") or registry or task or name in used, f"nothing imports {name}"
