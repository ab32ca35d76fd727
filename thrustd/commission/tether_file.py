"""What a tethered run has told, as a calibration file."""

from collections.abc import Mapping

import msgspec
import numpy as np

from thrustd.commission.recalibrate import recalibrate_by
from thrustd.commission.tether_told import ENGINE_STD, Beyond, Line, TetherFit
from thrustd.core.calibration import Calibration, EngineCalibration, MountCalibration, Zero, write_calibration
from thrustd.core.errors import RecordingError
from thrustd.installation.installation import Installation

TOLD = {  # by a run, and what stands for it without one
    "gain": 1.0, "gain_std": None, "friction": 1.0, "beyond": 1.0, "beyond_std": None, "told_mm": None,
    "expansion_mm_k": 0.0, "expansion_std_mm_k": None, "reference_degc": 20.0,
}  # fmt: skip
FAR = 5.0  # sigmas of what an installation does: a gain out there is the cell's or the rope's
CURVE = np.linspace(0.0, 1.0, 9)  # of the range: knots of a bow


def with_tether(calibration: Calibration, fit: TetherFit, on: str, cell: str) -> Calibration:
    """The file with the run's gains and zeros; RecordingError, of `cell`, when no installation does what they say."""
    mounts = dict(calibration.mount)
    _check_gains({name: calibration.of(name).gain * factor for name, (factor, _) in fit.gains.items()}, cell)
    for name, (factor, gain_std) in fit.gains.items():
        old = mounts.get(name, MountCalibration())
        left_mm, std_mm = fit.zeros_mm[name]
        zero = Zero(on=on, mm=round(old.zero_mm + left_mm, 6), std_mm=max(round(std_mm, 6), 1e-6))
        for same_day in (kept for kept in old.zeros if kept.on == on):  # what it showed at rest before the run
            seen = {"seen_mm": same_day.at_rest_mm, "seen_std_mm": same_day.at_rest_std_mm}
            zero = msgspec.structs.replace(zero, **seen)
        line = fit.lines[name]
        old = _steeper(old, fit.beyond[name]) if name in fit.beyond else old
        mounts[name] = msgspec.structs.replace(
            old if old.read_mm else _bent(old, line),
            gain=round(old.gain * factor, 6),
            gain_std=round(gain_std, 6),
            friction=round(old.friction * fit.frictions[name], 4),
            expansion_mm_k=round(old.expansion_mm_k + line.expansion_mm_k, 9),
            expansion_std_mm_k=max(round(line.expansion_std_mm_k, 9), 1e-9),
            reference_degc=round(line.reference_degc, 3),
            zeros=(*(kept for kept in old.zeros if kept.on < on), zero),  # later ones were beside other numbers
        )
    engines = {name: EngineCalibration(max(round(std, 6), 1e-6)) for name, std in fit.engine_stds.items()}
    changed = msgspec.structs.replace(calibration, on=on, tethered=on, mount=mounts, engine=engines)
    return msgspec.structs.replace(changed, recalibrate_by=recalibrate_by(changed))


def without_tether(calibration: Calibration) -> Calibration:
    """What is known without a tethered run, which is read from there: the same run again says the same."""
    if calibration.tethered is None:
        return calibration
    mounts = {name: _untold(mount, calibration.tethered) for name, mount in calibration.mount.items()}
    return msgspec.structs.replace(calibration, tethered=None, engine={}, mount=mounts)


def _untold(mount: MountCalibration, on: str) -> MountCalibration:
    """Without gain, growth, friction and bow of the run of that day, and with its zero as it was seen at rest."""
    zeros = tuple(
        one if one.on != on else _at_rest(one) for one in mount.zeros if one.on != on or one.seen_mm is not None
    )
    curve = {} if mount.curve_std_mm is not None else {"read_mm": (), "true_mm": ()}
    return msgspec.structs.replace(mount, zeros=zeros, **TOLD, **curve)


def _at_rest(zero: Zero) -> Zero:
    return Zero(on=zero.on, mm=zero.at_rest_mm, std_mm=zero.at_rest_std_mm)


def without_run(installation: Installation) -> Installation:
    """As if its calibration held nothing that a tethered run said."""
    known = installation.calibration()
    if known is None or known.tethered is None:
        return installation
    return installation.calibrated_by(write_calibration(without_tether(known)))


def _check_gains(gains: dict[str, float], cell: str) -> None:
    if said := gains_too_far(gains):
        asked = "is the cell calibrated, does all of the pull go through it, and is the model this mount's?"
        raise RecordingError(f"{cell}: {said[0]}: {asked}")


def gains_too_far(gains: Mapping[str, float]) -> list[str]:
    """By mount, the farthest first: what no tethered run is believed to say."""
    far = [name for name, gain in gains.items() if abs(gain - 1.0) > FAR * ENGINE_STD]
    limits = f"expected {1 - FAR * ENGINE_STD:.2f} to {1 + FAR * ENGINE_STD:.2f}"
    far.sort(key=lambda name: -abs(gains[name] - 1.0))
    return [f"gain of {name} {gains[name]:.3f}, {limits}" for name in far]


def _bent(mount: MountCalibration, line: Line) -> MountCalibration:
    """With the bow as a curve."""
    read = line.range_mm * CURVE
    true = read - line.bow_mm * 4.0 * CURVE * (1.0 - CURVE)
    told = {"read_mm": read, "true_mm": true}
    return msgspec.structs.replace(mount, **{name: tuple(np.round(mm, 6).tolist()) for name, mm in told.items()})


def _steeper(mount: MountCalibration, told: Beyond) -> MountCalibration:
    """With what was found of its curve beyond its bench."""
    std, told_mm = max(round(told.std, 6), 1e-6), round(told.told_mm, 6)
    factor = round(mount.beyond * told.factor, 4)
    return msgspec.structs.replace(mount, beyond=factor, beyond_std=std, told_mm=told_mm)
