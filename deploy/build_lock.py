"""Write deploy/requirements.txt: every package that flies, pinned, with the SHA-256 of each file it may come from.

    python deploy/build_lock.py        reads pyproject.toml and requirements.lock; the same input gives the same file

One file for every aircraft computer: what pip installs here (a package without wheels is built from its source), and
the wheels for all PYTHONS on all MACHINES. Run it under the oldest of PYTHONS: newer ones need no more packages.
"""

import json
import subprocess
import sys
from collections import defaultdict
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).parents[1]
HEAD = "# made by deploy/build_lock.py from pyproject.toml and requirements.lock\n"
PYTHONS = ("3.11", "3.12", "3.13")
MACHINES = ("x86_64", "aarch64")
GLIBC = ("manylinux2014", "manylinux_2_17", "manylinux_2_27", "manylinux_2_28", "manylinux_2_34", "manylinux_2_35")
Item = dict[str, Any]


def main() -> None:
    here = [item for item in report(["-c", "requirements.lock", "."]) if item["metadata"]["name"] != "thrustd"]
    wheels = [pin(item) for item in here if item["download_info"]["url"].endswith(".whl")]
    there = [item for python, machine in product(PYTHONS, MACHINES) for item in elsewhere(wheels, python, machine)]
    hashes: dict[str, set[str]] = defaultdict(set)
    for item in [*here, *there]:
        hashes[pin(item)].add(f" --hash=sha256:{item['download_info']['archive_info']['hashes']['sha256']}")
    lines = [f"{name}{''.join(sorted(hashes[name]))}\n" for name in sorted(hashes, key=str.lower)]
    (ROOT / "deploy" / "requirements.txt").write_text(HEAD + "".join(lines))


def pin(item: Item) -> str:
    return f"{item['metadata']['name']}=={item['metadata']['version']}"


def elsewhere(pins: list[str], python: str, machine: str) -> list[Item]:
    """The wheels for another Python on another machine."""
    platforms = [word for glibc in GLIBC for word in ("--platform", f"{glibc}_{machine}")]
    with TemporaryDirectory() as nowhere:
        where = ["--only-binary=:all:", "--no-deps", "--target", nowhere, "--python-version", python, *platforms]
        return report([*where, *pins])


def report(arguments: list[str]) -> list[Item]:
    """What pip would install."""
    command = [sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed", "--quiet", "--report", "-"]
    done = subprocess.run([*command, *arguments], cwd=ROOT, capture_output=True, check=True)
    items: list[Item] = json.loads(done.stdout)["install"]
    return items


if __name__ == "__main__":
    main()
