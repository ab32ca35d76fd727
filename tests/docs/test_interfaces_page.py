"""docs/interfaces.md says every key of the configuration, and nothing that is not there."""

import re

import msgspec

from docs import build_interfaces
from thrustd.core.config import Config
from thrustd.fusion.settings import FusionSettings
from thrustd.wire.can_table import CanRow, CanUnits

PLAIN = {"fusion": FusionSettings, "can.units": CanUnits, "can.input": CanRow}  # plain tables in Config


def keys_of(kind, path=""):
    """Every key below a struct that is a value, by its full name."""
    for field in msgspec.inspect.type_info(kind).fields:
        name, key = path + field.encode_name, PLAIN.get(path + field.encode_name)
        parts = (field.type, *getattr(field.type, "types", ()), getattr(field.type, "item_type", None))
        within = [part.cls for part in parts if isinstance(part, msgspec.inspect.StructType)]
        if key is not None or within:
            yield from keys_of(key or within[0], name + ".")
        else:
            assert not any(isinstance(part, msgspec.inspect.DictType) for part in parts), f"{name}: which keys?"
            yield name


def test_the_page_has_every_key_of_the_configuration_and_no_other():
    chapter = build_interfaces.page().partition("## Configuration keys")[2]
    assert re.findall(r"^\| `([a-z0-9_.]+)` \|", chapter, re.MULTILINE) == sorted(keys_of(Config), key=chapter.index)
    assert len(set(keys_of(Config))) > 60


def test_a_key_says_its_default_or_that_it_is_required():
    chapter = build_interfaces.page().partition("## Configuration keys")[2]
    assert "NODEFAULT" not in chapter
    assert re.search(r"^\| `deck` \| text \| required \|", chapter, re.MULTILINE)
    assert re.search(r"^\| `adc.baud` \| .* \| `921600` \|", chapter, re.MULTILINE)


def test_a_table_that_may_be_absent_says_what_then():
    for section in re.findall(r"^### \[.*?\n\n(.*)", build_interfaces.page(), re.MULTILINE):
        assert section.startswith(("Required.", "Optional; without it "))


def test_the_bus_has_every_identifier_thrustd_hears_and_sends():
    page = build_interfaces.page()
    for row in ("| 318 | `MachNumber` | - | `mach` |", "| 1850 to 1851 | `Engine1_Thrust` to `Engine2_Thrust` | N |"):
        assert row in page
