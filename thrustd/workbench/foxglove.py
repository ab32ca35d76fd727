"""A layout for Foxglove that draws our logs: per engine the thrust of every source, sigma and status; mounts; faults.

Topics and fields are those of `wire.log_layout`. In Foxglove: Layouts, Import from file.
"""

from collections.abc import Iterable, Sequence
from typing import Any

from thrustd.wire.log_layout import FAULT_TOPIC, TRUTH_TOPIC

THRUST = (("thrust_n", "fused", "#0072b2"), ("mount_n", "mount source", "#d55e00"),
          ("brochure_n", "brochure source", "#009e73"))  # fmt: skip


def foxglove_layout(engines: Sequence[str], mounts: Sequence[str]) -> dict[str, Any]:
    """The layout as Foxglove exports one: panels by name, and how they share the window."""
    panels: dict[str, Any] = {}
    for engine in engines:
        lines = [(f"/estimate/{engine}.{field}", label, color) for field, label, color in THRUST]
        lines.append((f"{TRUTH_TOPIC}{engine}.thrust_n", "truth", "#16202b"))
        panels[f"Plot!thrust_{engine}"] = _plot(f"{engine} engine: net thrust [N], forward +", lines)
        panels[f"Plot!sigma_{engine}"] = _plot(
            f"{engine} engine: one sigma [N]", [(f"/estimate/{engine}.thrust_std_n", "one sigma", "#0072b2")]
        )
        panels[f"StateTransitions!status_{engine}"] = {
            "foxglovePanelTitle": f"{engine} engine: status bits",
            "isSynced": True,
            "paths": [{"value": f"/estimate/{engine}.status", "timestampMethod": "receiveTime"}],
        }
    if mounts:
        lines = [(f"/mount/{mount}.deformation_mm", mount, "") for mount in mounts]
        panels["Plot!mounts"] = _plot("deformation of the mounts [mm], loaded by forward thrust +", lines)
    panels["RawMessages!faults"] = {"foxglovePanelTitle": "faults", "topicPath": FAULT_TOPIC, "diffEnabled": False}
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 5},
        "layout": _stacked(list(panels)),
    }


def _plot(title: str, lines: Iterable[tuple[str, str, str]]) -> dict[str, Any]:
    paths = [
        {"value": path, "label": label, "enabled": True, "timestampMethod": "receiveTime"}
        | ({"color": color} if color else {})
        for path, label, color in lines
    ]
    return {
        "foxglovePanelTitle": title, "paths": paths, "isSynced": True, "xAxisVal": "timestamp", "showLegend": True,
        "legendDisplay": "floating", "showXAxisLabels": True, "showYAxisLabels": True,
        "showPlotValuesInLegend": True, "sidebarDimension": 240,
    }  # fmt: skip


def _stacked(names: list[str]) -> Any:
    """One above the other, each the same height."""
    if len(names) == 1:
        return names[0]
    return {
        "direction": "column",
        "first": names[0],
        "second": _stacked(names[1:]),
        "splitPercentage": 100 / len(names),
    }
