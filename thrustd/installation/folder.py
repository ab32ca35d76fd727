"""The configuration that a command line names: a file, or a folder with one, as `commission` makes it."""

import re
from pathlib import Path

from thrustd.core.errors import ConfigError
from thrustd.sources.plain_file import read_text

OF_ADC = re.compile(r"^[ \t]*\[adc\]", re.MULTILINE)  # a table that every configuration has, and no other file


def configuration_of(given: str) -> Path:
    """The file itself; of a folder the only configuration in it, else a ConfigError in one line."""
    path = Path(given)
    if not path.is_dir():
        return path
    found = [one for one in sorted(path.glob("*.toml")) if OF_ADC.search(read_text(one))]
    if len(found) != 1:
        named = ", ".join(one.name for one in found) or "none"
        raise ConfigError(f"{path}: a folder; expected one configuration in it, there is {named}")
    return found[0]
