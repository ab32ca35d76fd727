"""One word per idea: what `docs/glossary.md` replaced is gone from code and pages."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
OLD = re.compile(
    r"\btare[ds]?\b|\baccus\w+|\bnot believed\b|\b(?:mounts?'?s?|brochure|thrust|deck'?s?) routes?\b", re.IGNORECASE
)
PLACES = (
    "thrustd/**/*.py",
    "benchmarks/*.py",
    "thrustd/**/*.js",
    "thrustd/**/*.html",
    "docs/*.md",
    "deploy/*.toml",
    "*.md",
    "models/*.json",
)
TELL_IT = {"glossary.md"}  # what the word was


def test_old_words_are_gone():
    files = [path for place in PLACES for path in ROOT.glob(place) if path.name not in TELL_IT]
    assert len(files) > 300
    assert not [f"{path.relative_to(ROOT)}: {old[0]}" for path in files for old in OLD.finditer(path.read_text())]
