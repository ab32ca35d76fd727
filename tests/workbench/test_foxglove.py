"""The Foxglove layout names topics and fields that our logs have."""

import re
from typing import get_type_hints

from thrustd.wire.log_layout import Topics
from thrustd.workbench.foxglove import foxglove_layout

ENGINES, MOUNTS = ("left", "right"), ("left_upper", "left_lower")


def test_every_path_is_a_field_of_a_topic_of_ours():
    topics = Topics(ENGINES, MOUNTS)
    known = {one.topic: one.kind for one in [*topics.fixed(), *(topics.of_truth(name) for name in ENGINES)]}
    layout = foxglove_layout(ENGINES, MOUNTS)
    paths = [path["value"] for panel in layout["configById"].values() for path in panel.get("paths", [])]
    assert len(paths) == 2 * 6 + 2
    for path in paths:
        topic, field = path.split(".")
        assert field in get_type_hints(known[topic]), path
    assert layout["configById"]["RawMessages!faults"]["topicPath"] in known


def test_every_panel_has_its_place():
    layout = foxglove_layout(ENGINES, MOUNTS)
    placed = re.findall(r"'((?:Plot|StateTransitions|RawMessages)![^']+)'", str(layout["layout"]))
    assert sorted(placed) == sorted(layout["configById"])
