"""The claim on a configuration: held once, by whatever name it is called, and gone with its process."""

import os

import pytest

from thrustd.core.errors import UsageError
from thrustd.onboard.one_process import only_one


def test_everyone_who_asks_is_told_who_flies(tmp_path):
    config, link = tmp_path / "a.toml", tmp_path / "link.toml"
    config.touch()
    link.symlink_to(config)
    with only_one(config):
        for name in (config, link) * 10:
            with pytest.raises(UsageError, match=rf"flown by process {os.getpid()} already"), only_one(name):
                pass
    with only_one(link):
        pass


def test_a_link_that_leads_to_itself_is_a_name_as_any(tmp_path):
    loop = tmp_path / "checkpoint.json"
    loop.symlink_to(loop)
    with only_one(loop), pytest.raises(UsageError, match="already"), only_one(loop):
        pass
