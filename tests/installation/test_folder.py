"""A folder with one configuration, as `commission` makes it, is that configuration."""

import pytest

from thrustd.__main__ import main
from thrustd.core.errors import ConfigError
from thrustd.installation.folder import configuration_of
from thrustd.installation.shipped import shipped


@pytest.fixture
def folder(tmp_path):
    root = shipped("deploy/hil.toml", "").parents[1]
    for name in ("hil.toml", "citation-ii.toml", "canaerospace.dbc"):
        (tmp_path / name).write_text((root / "deploy" / name).read_text().replace('"../models', f'"{root}/models'))
    (tmp_path / "calibration.toml").write_text('on = "2026-01-01"\n')
    return tmp_path


def test_check_takes_the_folder(folder, capsys):
    assert configuration_of(str(folder)) == folder / "hil.toml" == configuration_of(str(folder / "hil.toml"))
    assert main(["check", str(folder)]) == 0
    capsys.readouterr()


def test_a_folder_with_two_or_with_none_is_one_line(folder, capsys):
    (folder / "second.toml").write_text((folder / "hil.toml").read_text())
    assert main(["check", str(folder)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("expected one configuration in it, there is hil.toml, second.toml")
    (folder / "empty").mkdir()
    with pytest.raises(ConfigError, match="there is none"):
        configuration_of(str(folder / "empty"))
