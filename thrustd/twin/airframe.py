"""One simulated aircraft: two engines with their health, four isolators, and the forces between them.

The isolators of an engine carry its thrust minus what it takes to accelerate and to hold it along the body axis,

    F_carried = thrust - m g0 f_x,    m = 373 kg, split between upper and lower by their stiffness

so an engine at 0.1 g of specific force pulls 366 N less than its thrust. Which aircraft it is, a seed decides: biases
and drifts of the engines, stiffness and zero of every mount, the share between upper and lower.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from thrustd.core.columns import Floats
from thrustd.records.recording import Recording
from thrustd.twin.engine import Health, draw_health
from thrustd.twin.installation import PLAIN, Knobs, carried_parts, loads
from thrustd.twin.mount import LOWER, UPPER, MountPhysics, MountState, advance, at_rest
from thrustd.twin.sensors import Lvdt

ENGINES = ("left", "right")
MOUNTS = ("left_upper", "left_lower", "right_upper", "right_lower")  # ADC channels 0..3, ICD section 1
UPPER_SHARE = 5079.0 / (5079.0 + 5954.0)
SETTLING_S = 1800.0  # running engines have loaded the mounts for this long before a recording starts
LAST_FLIGHT_N = np.concatenate([np.linspace(0.0, 4500.0, 60), np.full(3600, 1500.0), np.zeros(43_200)])  # a second each
WARMING_S = 900.0  # of a mount, first order
BLEED_K = (15.0, 45.0)  # mount above the outside air: with the engine off, and on top of it at 100 % N1


class Airframe(NamedTuple):
    healths: tuple[Health, ...]  # per engine
    mounts: tuple[MountPhysics, ...]  # in the order of MOUNTS
    lvdts: tuple[Lvdt, ...]
    upper_share: tuple[float, ...]  # per engine
    knobs: Knobs = PLAIN


def draw_airframe(seed: int, knobs: Knobs = PLAIN) -> Airframe:
    """The aircraft of one seed: stiffness 0.3 %, LVDT zero 4 um, share 0.5 % (one sigma each)."""
    rng = np.random.default_rng([seed, 3])
    mounts = []
    for nominal in (UPPER, LOWER, UPPER, LOWER):
        factor = (1 + 0.003 * rng.standard_normal()) * (1 + knobs.stiffness)
        mounts.append(
            nominal._replace(
                stiffness_n_mm=nominal.stiffness_n_mm * factor,
                cubic_n_mm3=nominal.cubic_n_mm3 * factor,
                friction_n=tuple(float(force_n * rng.uniform(0.8, 1.2)) for force_n in nominal.friction_n),
            )
        )
    return Airframe(
        healths=tuple(draw_health(rng, side) for side in range(2)),
        mounts=tuple(mounts),
        lvdts=tuple(Lvdt(zero_mm=float(0.004 * rng.standard_normal())) for _ in MOUNTS),
        upper_share=tuple(float(UPPER_SHARE * (1 + 0.005 * rng.standard_normal())) for _ in ENGINES),
        knobs=knobs,
    )


def thrust_shares_n(airframe: Airframe, thrust_n: Floats) -> Floats:
    """Thrust of the engines (2, n) -> each mount's share of it (4, n)."""
    parts = [float(loads()[0, 0])] * len(ENGINES) if airframe.knobs.statics else airframe.upper_share
    upper = np.array(parts)[:, None]
    return np.stack((upper * thrust_n, (1 - upper) * thrust_n), axis=1).reshape(4, -1)


def carried_n(airframe: Airframe, thrust_n: Floats, accel_g: Floats, pressure_pa: Floats | float = 0.0) -> Floats:
    """What each mount really carries (4, n), from thrust (2, n), specific force (3, n) and dynamic pressure (n,)."""
    pairs = zip(airframe.upper_share, thrust_n, strict=True)
    return np.vstack([carried_parts(share, airframe.knobs, one_n, accel_g, pressure_pa) for share, one_n in pairs])


def settled(airframe: Airframe, carried_at_start_n: Floats, flown: bool = False) -> tuple[MountState, ...]:
    """States of the mounts (4,) after a long time under these forces; zero force = at rest.

    `flown`: not new, but with what their last flight left in the friction, half a day ago.
    """
    states = tuple(at_rest(mount) for mount in airframe.mounts)
    seconds = round(SETTLING_S)
    for mount, state, force_n in zip(airframe.mounts, states, carried_at_start_n, strict=True):
        if flown:
            advance(mount, state, LAST_FLIGHT_N, 1.0)
        if force_n != 0.0:
            rise = np.minimum(np.arange(1, seconds + 1) / 10.0, 1.0)
            advance(mount, state, rise * float(force_n), 1.0)
    return states


def rigged_mm(airframe: Airframe) -> list[float]:
    """What the transducers were set to zero at (4,): mounts under the engine's weight alone, for a long time."""
    if not airframe.knobs.statics:
        return [0.0] * len(MOUNTS)
    still = np.zeros((len(ENGINES), 1)), np.array([[0.0], [0.0], [1.0]])
    loads_n = carried_n(airframe, *still)[:, 0]
    states = settled(airframe, loads_n)
    return [
        float(advance(mount, state, np.array([load_n]), 1.0)[0])
        for mount, state, load_n in zip(airframe.mounts, states, loads_n, strict=True)
    ]


def mount_temperature_degc(profile: Recording, engine: str) -> Floats:
    """Temperature of the isolators of one engine along the profile (n,): a first-order lag behind bleed air and oil."""
    target = profile["sat_degC"] + BLEED_K[0] + BLEED_K[1] * np.clip(profile[f"n1_pct_{engine}"] / 100, 0, 1)
    keep = float(np.exp(-1 / (profile.sample_hz * WARMING_S)))
    warm, _ = lfilter([1 - keep], [1, -keep], target, zi=[keep * target[0]])
    return np.asarray(warm)
