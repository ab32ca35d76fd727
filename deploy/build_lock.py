"""Write deploy/requirements.txt: every package that flies, pinned, with the SHA-256 of the file it is installed from.

    python deploy/build_lock.py        reads pyproject.toml and requirements.lock; the same input gives the same file

The hashes are those of the wheels for the machine this runs on (run it on the aircraft computer's kind of machine).
"""

import json
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
HEAD = "# made by deploy/build_lock.py from pyproject.toml and requirements.lock\n"


def main() -> None:
    command = ["install", "--dry-run", "--ignore-installed", "--quiet", "--report", "-", "-c", "requirements.lock", "."]
    report = subprocess.run([sys.executable, "-m", "pip", *command], cwd=HERE.parent, capture_output=True, check=True)
    lines = sorted(filter(None, map(line, json.loads(report.stdout)["install"])), key=str.lower)
    (HERE / "requirements.txt").write_text(HEAD + "".join(lines))


def line(item: dict[str, dict[str, object]]) -> str:
    """One pinned package; nothing for thrustd itself, which comes as a wheel of its own."""
    name, version = item["metadata"]["name"], item["metadata"]["version"]
    if name == "thrustd":
        return ""
    archive = item["download_info"]["archive_info"]
    assert isinstance(archive, dict)
    return f"{name}=={version} --hash=sha256:{archive['hashes']['sha256']}\n"


if __name__ == "__main__":
    main()
