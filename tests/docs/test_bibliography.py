"""Every source that an effect's card or a docstring names is in docs/bibliography.md."""

import re
from pathlib import Path

import pytest

import thrustd
from tests.conftest import ROOT
from thrustd.model.effects import shelf

PAGE = (ROOT / "docs" / "bibliography.md").read_text()
NO_AUTHORS = {"Newton", "Taylor"}  # laws
TEXTS = {path.stem: path.read_text() for path in Path(thrustd.__file__).parent.rglob("*.py")}
REFERENCES = [line for text in TEXTS.values() for line in re.findall(r"Reference: (.*)", text)]


@pytest.mark.parametrize("name", sorted(shelf()))
def test_sources_of_effects_are_listed(name):
    for source in shelf()[name].source.split(";"):
        author = re.match(r"\s*([A-Z][a-z]+)", source)
        assert author is None or author[1] in NO_AUTHORS or author[1] in PAGE, source


def test_references_of_docstrings_are_listed():
    assert len(REFERENCES) > 5
    for line in REFERENCES:
        first = re.search(r"[A-Z][A-Za-z-]+", line.replace("S. Cheshire", "Cheshire"))
        assert first is not None and first[0] in PAGE, line
