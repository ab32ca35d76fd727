"""What stands in the package is used by the package: not by tests and benchmarks alone."""

import ast
import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILES = sorted((ROOT / "thrustd").rglob("*.py"))
SAID_ELSEWHERE = (ROOT / "pyproject.toml").read_text() + (ROOT / "thrustd" / "api" / "__init__.py").read_text()
OTHERS_CALL = {"_repr_html_", "_repr_png_", "_recv_internal"}  # a notebook, python-can
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


def test_every_module_is_imported_by_another():
    text = "".join(path.read_text() for path in FILES) + SAID_ELSEWHERE
    for path in FILES:
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        folder = name.rpartition(".")[0]
        if path.stem in ("__init__", "__main__") or folder == "thrustd.model.effects":  # that folder is the registry
            continue
        own = path.read_text()
        by_name = rf"{re.escape(name)}\b|from {re.escape(folder)} import [^\n]*\b{path.stem}\b|\b{path.stem}\.\w"
        assert re.search(by_name, text.replace(own, "")), f"nothing imports {name}"
