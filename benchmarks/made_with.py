"""Which version of the program, and which settings, made a result that is kept: others do not go on from it.

The version is a hash of all that a result can depend on; the commit stands beside it for people, with `-dirty` where
files were changed since. A commit that changes a page or a test alone is no other version.
"""

import hashlib
import json
import subprocess
from pathlib import Path
from typing import Any

import thrustd

CODE = "thrustd/**/*.py", "deploy/*.toml", "deploy/*.dbc", "models/brochure/*.json"
SHOWN = 12  # digits of a hash
Way = dict[str, Any]


def way_of(**settings: Any) -> Way:
    """How a result is made now."""
    root = Path(thrustd.__file__).parents[1]
    return {"commit": _commit(root), "code": _code(root), **settings}


def kept_of(path: Path, way: Way) -> Way | None:
    """The result in a file, None where there is none; SystemExit, one line, where it was made in another way."""
    if not path.exists():
        return None
    found = json.loads(path.read_text())
    before = found.get("made_with", {}) if isinstance(found, dict) else {}
    names = [name for name in way if name != "commit" and before.get(name) != way[name]]
    if names:
        other = ", ".join(f"{name} {before.get(name, 'not said')}" for name in dict.fromkeys(("commit", *names)))
        now = ", ".join(f"{name} {way[name]}" for name in dict.fromkeys(("commit", *names)))
        raise SystemExit(f"{path}: made with {other}; this is {now}: remove {path.parent}, or give another --folder")
    return found


def keep(path: Path, way: Way, result: Way) -> Way:
    """Write it with the way that it was made."""
    whole = {"made_with": way, **result}
    path.write_text(json.dumps(whole))
    return whole


def _code(root: Path) -> str:
    paths = sorted(path for pattern in CODE for path in root.glob(pattern))
    digest = hashlib.sha256()
    for path in paths:
        digest.update(f"{path.relative_to(root)}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()[:SHOWN]


def _commit(root: Path) -> str:
    """`unknown` where this is no checkout."""
    try:
        asked = ("git", "-C", str(root), "describe", "--always", "--dirty", f"--abbrev={SHOWN}", "--exclude=*")
        return subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
