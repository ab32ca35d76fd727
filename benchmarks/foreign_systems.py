"""Other people's systems: `python -m benchmarks.foreign_systems [SYSTEM ...] [--structures NAME ...]`.

Simulations of public benchmarks of nonlinear identification by their published equations, in their units, rates and
lengths, with noise and starting where the apparatus happens to be. Prints, per structure, the fit on records that it
has not seen: 100 (1 - rmse / standard deviation), free run. No setting is tuned to a system.

    tanks       cascaded tanks with overflow        Schoukens, Mattsson, Wigren & Noel 2016: 1024 samples at 0.25 Hz
    silverbox   Duffing oscillator                  Wigren & Schoukens 2013: 610 Hz, judged on a growing arrow
    diode       Wiener-Hammerstein, diode clipper   Schoukens, Suykens & Ljung 2009: 51.2 kHz, 188 000 samples
    drives      coupled electric drives, |speed|    Wigren & Schoukens 2017: 500 samples at 50 Hz
    bouc-wen    hysteretic oscillator               Noel & Schoukens 2016: 750 Hz, multisine
    ph          neutralisation, titration curve     after Henson & Seborg 1994: 2000 samples at 0.1 Hz
    dryer       hair dryer, dead time               after Ljung 1999: 1000 samples at 12.5 Hz
"""

import argparse
from collections.abc import Callable
from time import process_time

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.signal import cheby1, cheby2, lfilter

from thrustd.identify.identify import identify
from thrustd.model.stage import Floats, jit
from thrustd.records.recording import Recording, make_recording

Pair = tuple[Recording, Recording]  # to fit, to judge
BLOCKS = ("hammerstein", "wiener", "hammerstein-wiener", "hw-pwl", "wiener-hammerstein")
STRUCTURES = ("static-pwl", "oe-6-4", *BLOCKS, "feedback")


def multisine(n: int, rate_hz: float, low_hz: float, high_hz: float, rng: np.random.Generator) -> Floats:
    """Random phases, equal lines from low to high, standard deviation 1; one period is n samples."""
    lines = np.zeros(n // 2 + 1, complex)
    at = np.arange(max(1, int(low_hz * n / rate_hz)), int(high_hz * n / rate_hz))
    lines[at] = np.exp(2j * np.pi * rng.random(len(at)))
    signal = np.fft.irfft(lines, n)
    return signal / np.std(signal)


def noisy(signal: Floats, sigma: float, rng: np.random.Generator) -> Floats:
    return signal + sigma * rng.standard_normal(len(signal))


def recording(name: str, rate_hz: float, u: Floats, y: Floats) -> Recording:
    return make_recording(name, {"time_s": np.arange(len(u)) / rate_hz, "deformation_mm": u, "force_N": y})


@jit
def _tank_levels(u: Floats, dt_s: float, upper: float, lower: float) -> Floats:
    """x1' = k4 u - k1 sqrt x1, x2' = k2 sqrt x1 - k3 sqrt x2; what the upper tank spills falls half into the lower."""
    out = np.empty(len(u))
    for k in range(len(u)):
        out[k] = lower
        for _ in range(20):
            spill = 0.0
            rise = 0.031 * u[k] - 0.045 * np.sqrt(max(upper, 0.0))
            if upper >= 10.0 and rise > 0.0:
                spill, rise = 0.5 * rise, 0.0
            fall = 0.045 * np.sqrt(max(upper, 0.0)) - 0.042 * np.sqrt(max(lower, 0.0)) + spill
            upper += dt_s / 20 * rise
            lower = min(10.0, lower + dt_s / 20 * fall)
    return out


def tanks() -> Pair:
    def one(seed: int) -> Recording:
        rng = np.random.default_rng(seed)
        u = 2.9 + 1.1 * multisine(1024, 0.25, 0.0, 0.0144, rng)
        y = _tank_levels(u, 4.0, rng.uniform(3, 6), rng.uniform(3, 6))
        return recording(f"tanks {seed}", 0.25, u, noisy(np.minimum(y, 10.0), 0.03, rng))

    return one(1), one(2)


@jit
def _duffing(u: Floats, dt_s: float) -> Floats:
    """y'' + 2 z w y' + w^2 y + k3 y^3 = w^2 g u: 68 Hz, lightly damped; semi-implicit steps, 20 per sample."""
    out, y, v = np.empty(len(u)), 0.0, 0.0
    w = 2 * np.pi * 68.0
    for k in range(len(u)):
        out[k] = y
        for _ in range(20):
            v += dt_s / 20 * (w * w * (0.9 * u[k] - y - 3.9 * y**3) - 2 * 0.05 * w * v)
            y += dt_s / 20 * v
    return out


def silverbox() -> Pair:
    rng, rate_hz = np.random.default_rng(3), 610.35
    u = 0.0223 * np.concatenate([multisine(8192, rate_hz, 0.0, 200.0, rng) for _ in range(6)]) * 2.0
    arrow = lfilter(*cheby1(2, 1, 200.0, fs=rate_hz), rng.standard_normal(40_000)) * np.linspace(0, 0.08, 40_000)
    records = [
        recording(f"silverbox {name}", rate_hz, x, noisy(_duffing(x, 1 / rate_hz), 2e-4, rng))
        for name, x in (("multisine", u), ("arrow", arrow))
    ]
    return records[0], records[1]


def diode() -> Pair:
    rng, rate_hz = np.random.default_rng(4), 51_200.0
    u = lfilter(*cheby1(4, 1, 10_000.0, fs=rate_hz), rng.standard_normal(188_000)) * 1.2
    x = lfilter(*cheby1(3, 0.5, 4400.0, fs=rate_hz), u)
    clipped = np.where(x > 0, np.log1p(8 * np.maximum(x, 0)) / 8 * 1.5 + 0.1 * x, x)  # one-sided diode and resistor
    y = noisy(lfilter(*cheby2(3, 40, 5000.0, fs=rate_hz), clipped), 2e-4, rng)
    whole = recording("diode", rate_hz, u, y)
    return whole.rows(slice(0, 100_000)), whole.rows(slice(100_000, 188_000))


@jit
def _pulley(u: Floats, dt_s: float, speed: float) -> Floats:
    """A lag (motor) drives a belt pulley on a spring: three states; the counter gives the speed without its sign."""
    out, lagged, accel = np.empty(len(u)), speed, 0.0
    for k in range(len(u)):
        out[k] = abs(speed)
        for _ in range(20):
            lagged += dt_s / 20 * (1.6 * u[k] - lagged) / 0.45
            accel += dt_s / 20 * (22.0 * 22.0 * (lagged - speed) - 2 * 0.18 * 22.0 * accel)
            speed += dt_s / 20 * accel
    return out


def drives() -> Pair:
    def one(seed: int) -> Recording:
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(-1.5, 1.5, 500 // 10), 10)
        return recording(f"drives {seed}", 50.0, u, noisy(_pulley(u, 0.02, rng.uniform(-1, 1)), 0.02, rng))

    return one(5), one(6)


@jit
def _bouc_wen(u: Floats, dt_s: float) -> Floats:
    """m y'' + c y' + k y + z = u, z' = a y' - b (g |y'| z + d y' |z|)."""
    out, y, v, z = np.empty(len(u)), 0.0, 0.0, 0.0
    for k in range(len(u)):
        out[k] = y
        for _ in range(20):
            z += dt_s / 20 * (5e4 * v - 1e3 * (0.8 * abs(v) * z - 1.1 * v * abs(z)))
            v += dt_s / 20 * (u[k] - 10.0 * v - 5e4 * y - z) / 2.0
            y += dt_s / 20 * v
    return out


def bouc_wen() -> Pair:
    rng = np.random.default_rng(7)
    records = []
    for name in ("fit", "judge"):
        u = 50.0 * np.tile(multisine(8192, 750.0, 5.0, 150.0, rng), 2)
        records.append(recording(f"bouc-wen {name}", 750.0, u, noisy(_bouc_wen(u, 1 / 750.0), 8e-6, rng)))
    return records[0], records[1]


def ph() -> Pair:
    def one(seed: int) -> Recording:
        rng = np.random.default_rng(seed)
        u = 15.0 + np.repeat(rng.uniform(-4, 4, 40), 50)
        x = lfilter([0.12], [1, -0.88], lfilter([0.05], [1, -0.95], u - 15.0, zi=[0.95 * (u[0] - 15.0)])[0])
        return recording(f"ph {seed}", 0.1, u, noisy(7 + 2.4 * np.arcsinh(3 * x), 0.03, rng))

    return one(8), one(9)


def dryer() -> Pair:
    def one(seed: int) -> Recording:
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.choice([3.4, 6.4], 250), 4)
        y = lfilter([0, 0, 0, 0.065, 0.045], [1, -1.27, 0.39], u - 4.9)
        return recording(f"dryer {seed}", 12.5, u, noisy(4.9 + y, 0.04, rng))

    return one(10), one(11)


SYSTEMS: dict[str, Callable[[], Pair]] = {
    "tanks": tanks,
    "silverbox": silverbox,
    "diode": diode,
    "drives": drives,
    "bouc-wen": bouc_wen,
    "ph": ph,
    "dryer": dryer,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("systems", nargs="*", metavar="SYSTEM", help=", ".join(SYSTEMS))
    parser.add_argument("--structures", nargs="+", default=STRUCTURES)
    given = parser.parse_args()
    table = Table(title="fit on unseen records, % (and on those fitted to)")
    for name in ("structure", *(given.systems or SYSTEMS)):
        table.add_column(name, justify="right")
    columns = [_fits(SYSTEMS[name], given.structures) for name in given.systems or SYSTEMS]
    for row, structure in enumerate(given.structures):
        table.add_row(structure, *(column[row] for column in columns))
    Console(width=160).print(table)
    print(f"{process_time():.0f} s of processor time")


def _fits(system: Callable[[], Pair], structures: list[str]) -> list[str]:
    train, unseen = system()
    found = identify([train], [unseen], structures)
    return [
        f"{s.validation.fit_pct:.1f} ({100 * (1 - s.train.rmse_n / float(np.nanstd(train['force_N']))):.1f})"
        if s.validation.stable
        else "unstable"
        for s in found.scores
    ]


if __name__ == "__main__":
    main()
