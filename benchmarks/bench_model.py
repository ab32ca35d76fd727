"""What a model step costs, per sample in flight and in blocks on the ground: `python -m benchmarks bench_model`."""

import shutil
import statistics
import subprocess
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from thrustd.model.artifact import RealMode, read_model
from thrustd.model.c_model import c_source
from thrustd.model.compile import CompiledModel, compile_model

MODEL = Path(__file__).parents[1] / "models" / "left-upper.json"
THESIS_SAMPLES = 13_400_000  # 37 h at 100 Hz
CALLS = 50_000
TOGETHER = 10  # samples of a mount from one fused step to the next, 100 Hz and 10 Hz
RUNS = 7
LAGS = 20  # as many as `identify` may take
C_STEPS = 10_000_000
C_LOOP = """
#include <stdio.h>
#include <time.h>
int main(void)
{
    mount_state s;
    mount_inputs in = {0};
    double sum = 0.0;
    clock_t begin = clock();
    long k;
    mount_init(&s, &in);
    for (k = 0; k < LOOPS; k++) {
        in.deformation_mm = 0.2 + 0.8 * (double)(k % 20000) / 20000.0;
        sum += mount_step(&s, &in);
    }
    fprintf(stderr, "%g", sum);
    printf("%.9f", (double)(clock() - begin) / CLOCKS_PER_SEC);
    return 0;
}
"""


def sample_us(model: CompiledModel, together: int) -> float:
    """So many samples in one Python call; the pipeline hands over those of a fused step together."""
    channels, deformation_mm = np.ones((together, len(model.channels) - 1)), np.linspace(0.1, 1.0, together)
    state, v = model.start(np.ones(len(model.channels))), np.empty(together)
    times = []
    for _ in range(RUNS):
        start = time.process_time()
        for _ in range(CALLS):
            v[:] = deformation_mm
            model.run(state, channels, v)
        times.append(time.process_time() - start)
    return statistics.median(times) / CALLS / together * 1e6


def block_s(model: CompiledModel) -> float:
    """37 h of random steps, minutes each, as on the bench."""
    levels = np.repeat(np.random.default_rng(1).uniform(0.1, 1.1, 500), THESIS_SAMPLES // 500)
    inputs = np.zeros((len(levels), len(model.channels)))
    inputs[:, 0] = levels + 1e-3 * np.sin(np.arange(len(levels)) * 0.01)
    model.simulate(inputs[:1000])
    times = []
    for _ in range(RUNS):
        start = time.process_time()
        model.simulate(inputs)
        times.append(time.process_time() - start)
    return statistics.median(times)


def c_step_us(model: CompiledModel) -> float | None:
    """One sample in C, `cc -O2`, of ten million; None where there is no C compiler."""
    cc = shutil.which("cc")
    if cc is None:
        return None
    with TemporaryDirectory() as folder:
        (Path(folder) / "mount.c").write_text(c_source(model) + C_LOOP.replace("LOOPS", str(C_STEPS)))
        flags = ["-std=c99", "-O2", "-ffp-contract=off"]
        subprocess.run([cc, *flags, "mount.c", "-o", "mount", "-lm"], cwd=folder, check=True)
        runs = [subprocess.run([f"{folder}/mount"], capture_output=True, check=True, text=True) for _ in range(RUNS)]
    return statistics.median(float(run.stdout) for run in runs) / C_STEPS * 1e6


def main() -> None:
    spec = read_model(MODEL.read_text(), MODEL.name)
    bare = msgspec.structs.replace(spec, effects=[], witness=None)
    shown = Table("what", "measured", "target", title="model")
    lags = [RealMode(tau_s, -0.01) for tau_s in np.geomspace(0.02, 6e4, LAGS).tolist()]
    longer = msgspec.structs.replace(spec, linear=msgspec.structs.replace(spec.linear, real_modes=lags), witness=None)
    effects = f"with {len(spec.effects)} effects"
    for what, chosen in (("HW-PWL", bare), (effects, spec), (f"{effects}, {LAGS} lags", longer)):
        model = compile_model(chosen, 100.0)
        shown.add_row(f"one mount, one sample in flight, {what}", f"{sample_us(model, TOGETHER):.2f} us", "< 1 us")
        shown.add_row("... alone in a call from Python", f"{sample_us(model, 1):.2f} us", "")
        in_c = c_step_us(model)
        shown.add_row(
            "... in C (`compile --c`)", f"{in_c:.3f} us" if in_c is not None else "no C compiler", "< 0.15 us"
        )
    shown.add_row("13.4 million samples (37 h)", f"{block_s(compile_model(bare, 100.0)):.2f} s", "< 0.5 s")
    Console().print(shown)


if __name__ == "__main__":
    main()
