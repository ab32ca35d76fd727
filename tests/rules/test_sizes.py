"""Files of up to 300 lines, functions of up to 40 with up to seven arguments by position: read in one glance."""

import ast

from tests.conftest import ROOT

FILES = [path for folder in ("thrustd", "benchmarks") for path in sorted((ROOT / folder).rglob("*.py"))]
SCRIPTS = sorted((ROOT / "thrustd" / "workbench" / "static" / "js").rglob("*.js"))
FILE_LINES, FUNCTION_LINES, ARGUMENTS = 300, 40, 7


def functions(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield f"{path.relative_to(ROOT)}: {node.name}", node


def test_no_file_is_long():
    assert not {path.name for path in (*FILES, *SCRIPTS) if len(path.read_text().splitlines()) > FILE_LINES}


def test_no_function_is_long():
    long = {name for path in FILES for name, node in functions(path) if node.end_lineno - node.lineno >= FUNCTION_LINES}
    assert not long


def test_what_belongs_together_travels_as_a_record():
    assert not {name for path in FILES for name, node in functions(path)
                if len(node.args.posonlyargs + node.args.args) > ARGUMENTS}  # fmt: skip
