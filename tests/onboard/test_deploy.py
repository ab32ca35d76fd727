"""What is installed on the aircraft computer: the unit is clean and confined, versions switch and switch back."""

import json
import re
import shutil
import subprocess
import sys
import tomllib

import pytest

from tests.conftest import ROOT
from thrustd.core.config import read_config

DEPLOY = ROOT / "deploy"
EXPOSURE = 2.5  # issue 7


def systemd(*arguments):
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd-analyze is not installed here (Debian: apt install systemd)")
    return subprocess.run(["systemd-analyze", *arguments], capture_output=True, text=True, timeout=60, check=False)


def test_the_unit_is_confined():
    report = systemd("security", "--offline=true", "--no-pager", str(DEPLOY / "thrustd.service")).stdout
    found = re.search(r"exposure level for thrustd.service: ([0-9.]+)", report)
    assert found is not None
    assert float(found[1]) <= EXPOSURE


def test_the_unit_is_clean(tmp_path):
    unit = (DEPLOY / "thrustd.service").read_text().replace("/opt/thrustd/current/bin/thrustd", sys.executable)
    (tmp_path / "thrustd.service").write_text(unit)
    report = systemd("verify", str(tmp_path / "thrustd.service"))
    assert (report.returncode, [line for line in report.stderr.splitlines() if "thrustd" in line]) == (0, [])


@pytest.mark.parametrize("name", ["ph-lab.toml", "hil.toml"])
def test_the_configurations_are_read(name):
    config = read_config((DEPLOY / name).read_text(), name)
    assert config.health is not None
    assert config.warm_restart is not None


def test_every_package_that_flies_is_pinned_with_its_hash():
    lines = [line for line in (DEPLOY / "requirements.txt").read_text().splitlines() if not line.startswith("#")]
    pinned = dict(re.fullmatch(r"(\S+)==(\S+) --hash=sha256:[0-9a-f]{64}", line).groups() for line in lines)
    locked = dict(line.split("==") for line in (ROOT / "requirements.lock").read_text().split())
    names = {canonical(name): version for name, version in locked.items()}
    assert {canonical(name): version for name, version in pinned.items()}.items() <= names.items()
    wanted = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    assert {canonical(re.match(r"[\w.-]+", line)[0]) for line in wanted} <= set(map(canonical, pinned))


def test_the_bill_of_materials_is_what_is_pinned():
    bill = json.loads((DEPLOY / "sbom.cdx.json").read_text())
    listed = [f"{part['name']}=={part['version']} --hash=sha256:{part['hashes'][0]['content']}" for part in
              bill["components"]]  # fmt: skip
    lines = (DEPLOY / "requirements.txt").read_text().splitlines()
    assert sorted(listed) == sorted(line for line in lines if not line.startswith("#"))


def canonical(name):
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.mark.parametrize("script", sorted(DEPLOY.glob("*.sh")), ids=lambda path: path.name)
def test_scripts_parse(script):
    subprocess.run(["bash", "-n", str(script)], check=True)


def test_rollback_goes_back_and_forth(tmp_path):
    home = tmp_path / "opt" / "thrustd"
    home.mkdir(parents=True)
    (home / "current").symlink_to("versions/2")
    (home / "previous").symlink_to("versions/1")
    for expected in ("versions/1", "versions/2"):
        environment = {"DESTDIR": str(tmp_path), "PATH": "/usr/bin:/bin"}
        subprocess.run([str(DEPLOY / "rollback.sh")], env=environment, check=True, capture_output=True)
        assert str((home / "current").readlink()) == expected


def test_rollback_without_a_version_before_says_so(tmp_path):
    environment = {"DESTDIR": str(tmp_path), "PATH": "/usr/bin:/bin"}
    done = subprocess.run([str(DEPLOY / "rollback.sh")], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "no previous version" in done.stderr
    assert not (tmp_path / "opt").exists()
