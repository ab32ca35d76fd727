"""What is installed on the aircraft computer: the unit is clean and confined, versions switch and switch back."""

import json
import re
import shlex
import shutil
import subprocess
import sys
import tomllib

import pytest

from tests.conftest import ROOT
from thrustd.core.config import read_config
from thrustd.installation.installation import read_installation

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


def test_a_restart_comes_before_whatever_else_runs_here():
    unit = (DEPLOY / "thrustd.service").read_text().splitlines()
    assert {"Nice=-10", "CPUWeight=1000", "Restart=always", "OOMScoreAdjust=-900"} <= set(unit)


@pytest.mark.parametrize("name", ["ph-lab.toml", "hil.toml"])
def test_the_configurations_are_read(name):
    config = read_config((DEPLOY / name).read_text(), name)
    assert config.health is not None
    assert config.warm_restart is not None


def test_every_package_that_flies_is_pinned_with_its_hash():
    lines = [line for line in (DEPLOY / "requirements.txt").read_text().splitlines() if not line.startswith("#")]
    pinned = dict(re.fullmatch(r"(\S+)==(\S+)(?: --hash=sha256:[0-9a-f]{64})+", line).groups() for line in lines)
    locked = dict(line.split("==") for line in (ROOT / "requirements.lock").read_text().split())
    names = {canonical(name): version for name, version in locked.items()}
    assert {canonical(name): version for name, version in pinned.items()}.items() <= names.items()
    wanted = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    assert {canonical(re.match(r"[\w.-]+", line)[0]) for line in wanted} <= set(map(canonical, pinned))


def test_the_bill_of_materials_is_what_is_pinned():
    bill = json.loads((DEPLOY / "sbom.cdx.json").read_text())
    listed = [
        " ".join([f"{part['name']}=={part['version']}", *(f"--hash=sha256:{h['content']}" for h in part["hashes"])])
        for part in bill["components"]
    ]
    lines = (DEPLOY / "requirements.txt").read_text().splitlines()
    assert sorted(listed) == sorted(line for line in lines if not line.startswith("#"))


def test_every_package_of_the_bill_has_a_licence():
    bill = json.loads((DEPLOY / "sbom.cdx.json").read_text())
    assert [part["name"] for part in bill["components"] if not part.get("licenses")] == []
    told = {part["name"]: part["licenses"][0].get("license", {}).get("name", "") for part in bill["components"]}
    assert [name for name, words in told.items() if "BSD" in words] == []  # which one: SPDX has a name for each


def test_packages_with_compiled_code_are_pinned_for_more_than_one_kind_of_machine():
    lines = (DEPLOY / "requirements.txt").read_text().splitlines()
    hashes = {line.split("==")[0]: line.count("--hash") for line in lines}
    assert all(hashes[name] >= 6 for name in ("numpy", "scipy", "numba", "llvmlite", "pyarrow", "msgspec"))


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


class Computer:
    """An aircraft computer in a folder, whose Python, pip, thrustd and systemd do as they are told."""

    def __init__(self, folder):
        self.folder, self.home = folder, folder / "root" / "opt" / "thrustd"
        self.wheel = folder / "thrustd-1.2.3-py3-none-any.whl"
        self.wheel.write_bytes(b"")
        self.script("pip", "exit 0")
        self.script("thrustd", "exit 0")
        self.script("systemctl", "exit 0")
        tools = f'for tool in pip thrustd; do ln -s "{folder}/$tool" "$3/bin/$tool"; done'
        self.script("python", f'mkdir -p "$3/bin" && {tools}')

    def script(self, name, text):
        path = self.folder / name
        path.write_text(f"#!/bin/bash\n{text}\n")
        path.chmod(0o755)

    def run(self, name, *arguments):
        tools = {"PYTHON": self.folder / "python", "SYSTEMCTL": self.folder / "systemctl"}
        environment = {"DESTDIR": str(self.folder / "root"), "PATH": "/usr/bin:/bin"}
        environment |= {key: str(path) for key, path in tools.items()}
        return subprocess.run(
            [str(DEPLOY / name), *arguments], env=environment, capture_output=True, text=True, check=False
        )

    def install(self):
        return self.run("install.sh", str(self.wheel))

    def links(self):
        """What flies, what flew before, and what is there."""
        current, previous = (self.home / name for name in ("current", "previous"))
        there = sorted(path.name for path in (self.home / "versions").iterdir())
        return current.readlink().name, previous.readlink().name if previous.is_symlink() else "", there


@pytest.fixture
def computer(tmp_path):
    return Computer(tmp_path)


def test_the_same_version_is_installed_again_beside_itself_and_rolled_back(computer):
    assert computer.install().returncode == 0
    assert computer.links() == ("1.2.3.1", "", ["1.2.3.1"])
    assert computer.install().returncode == 0
    assert computer.links() == ("1.2.3.2", "1.2.3.1", ["1.2.3.1", "1.2.3.2"])
    assert computer.run("rollback.sh").returncode == 0
    assert computer.links()[:2] == ("1.2.3.1", "1.2.3.2")
    assert computer.install().returncode == 0
    assert computer.links() == ("1.2.3.3", "1.2.3.1", ["1.2.3.1", "1.2.3.3"])  # what neither flies nor flew is gone
    assert (computer.folder / "root/etc/systemd/system/thrustd.service").is_file()


@pytest.mark.parametrize("signed", [True, False])
def test_where_there_is_a_key_the_check_and_the_unit_ask_for_its_signature(computer, signed):
    computer.script("thrustd", f'echo "$@" >> {computer.folder}/said')
    key = computer.folder / "root/etc/thrustd-trust.pem"
    key.parent.mkdir(parents=True)
    if signed:
        key.write_text("")
    assert computer.install().returncode == 0
    (command,) = [
        line for line in (DEPLOY / "thrustd.service").read_text().splitlines() if line.startswith("ExecStart=")
    ]
    shell = shlex.split(command.removeprefix("ExecStart=").replace("$$", "$"))
    moved = [re.sub("(?=/(opt|etc)/)", str(computer.folder / "root"), word) for word in shell]
    subprocess.run(moved, check=True)
    config = computer.folder / "root/etc/thrustd/deploy/ph-lab.toml"
    trusts = f" --trust {key}" if signed else ""
    assert (computer.folder / "said").read_text() == f"check {config}{trusts}\nrun {config}{trusts}\n"


@pytest.mark.parametrize("broken", ["pip", "thrustd"])
def test_one_that_cannot_be_installed_or_does_not_read_the_configuration_changes_nothing(computer, broken):
    assert computer.install().returncode == 0
    before = computer.links()
    computer.script(broken, "exit 2")
    done = computer.install()
    assert done.returncode != 0
    assert "what flies is as it was" in done.stderr
    assert computer.links() == before


def test_one_that_does_not_start_is_left_for_the_one_before_with_its_unit(computer):
    assert computer.install().returncode == 0
    unit, kept = computer.folder / "root/etc/systemd/system/thrustd.service", "# of the first\n"
    (computer.home / "versions/1.2.3.1/system/thrustd.service").write_text(kept)
    bad = f'[ "$1" != restart ] || [ "$(readlink {computer.home}/current)" = versions/1.2.3.1 ]'
    computer.script("systemctl", bad)
    done = computer.install()
    assert done.returncode == 1
    assert "versions/1.2.3.2 does not start" in done.stderr
    assert "1.2.3.1 is current again" in done.stderr
    assert computer.links() == ("1.2.3.1", "", ["1.2.3.1"])
    assert unit.read_text() == kept


def test_the_configuration_of_the_aircraft_is_whole_and_never_overwritten(computer):
    assert computer.install().returncode == 0
    read_installation(computer.folder / "root/etc/thrustd/deploy/ph-lab.toml")  # and every file it names
    config = computer.folder / "root/etc/thrustd/deploy/ph-lab.toml"
    config.write_text("# ours\n")
    assert computer.install().returncode == 0
    assert config.read_text() == "# ours\n"


@pytest.mark.parametrize(("arguments", "says"), [([], "expected a wheel"), (["no.whl"], "no.whl: No such file")])
def test_without_a_wheel_nothing_is_built(computer, arguments, says):
    done = computer.run("install.sh", *arguments)
    assert done.returncode != 0
    assert says in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not computer.home.exists()
