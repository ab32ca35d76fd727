"""An engine of which one mount alone has a transducer: its thrust is that mount's over its share, by its own bank."""

import json

import pytest

from tests.conftest import ROOT
from thrustd.__main__ import main

LOG = ROOT / "replay_logs" / "throttle-steps.mcap"


@pytest.mark.parametrize(("dumb", "engine"), [("left_lower", "left"), ("right_upper", "right")])
def test_its_thrust_is_that_of_the_other_mount_over_its_share(dumb, engine, tmp_path, capsys):
    """It took the force of one mount for all of the thrust, 3 kN off, and its bank heard nobody."""
    text = (ROOT / "deploy" / "hil.toml").read_text().replace("../models", str(ROOT / "models"))
    for name in ("canaerospace.dbc", "citation-ii.toml"):
        text = text.replace(f'"{name}"', f'"{ROOT / "deploy" / name}"')
    head, *mounts = text.split("[[mount]]")
    config = tmp_path / "one.toml"
    config.write_text("[[mount]]".join([head, *(each for each in mounts if f'"{dumb}"' not in each)]))
    assert main(["replay", str(LOG), "--config", str(config), "--json"]) == 0
    fused = json.loads(capsys.readouterr().out)["scores"][engine]["fused"]
    assert fused["rmse_n"] < 120.0 and fused["inside_95_pct"] > 99.0
    assert main(["budget", str(LOG), "--config", str(config), "--at", "150", "160", "--json"]) == 0
    told = {one["engine"]: one for one in json.loads(capsys.readouterr().out)["engines"]}
    rows = {row["term"]: row["std_n"] for row in told[engine]["rows"]}
    assert rows["share"] == pytest.approx(
        0.006 * told[engine]["thrust_n"] / {"left": 0.46, "right": 0.54}[engine], rel=0.1
    )
    assert min(rows[f"installation, {term}"] for term in ("zero", "temperature", "scale", "drag", "rest")) > 10.0
