"""Look for a crash, longer than the tests do: `python -m benchmarks.fuzz --minutes 10`.

Rounds of new random input until the time is over: serial bytes random and mutated, CAN messages random and mutated,
damaged configurations, models, tables, logs, checkpoints and snapshots. Each must end in a value, a fault or one clear
line.
The first two run here, the others are the property tests under hypothesis with a new seed per round.
"""

import argparse
import os
import random
import re
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from rich.progress import Progress

from tests.wire.one_by_one import AdcSample, adc_items, can_items
from tests.wire.test_fuzz import DBC_TEXT, mutated_stream, resident_kb
from thrustd.core.faults import FAULT_KINDS
from thrustd.core.types import Fault, Frame
from thrustd.wire.adc_frames import AdcDecoder
from thrustd.wire.can_decoder import CanDecoder
from thrustd.wire.can_frames import ICD_INPUT_ROWS
from thrustd.wire.can_table import CanTable, CanUnits

ROOT = Path(__file__).parents[1]
ROUND_FRAMES, ROUND_MESSAGES = 50_000, 100_000
PROPERTIES = (
    "tests/cli/test_fuzz_files.py", "tests/onboard/test_checkpoint.py", "tests/wire/test_adc_frames.py",
    "tests/wire/test_can_frames.py", "tests/wire/test_event_batch.py", "tests/wire/test_framing.py",
    "tests/model/test_expression.py", "tests/pipeline/test_pipeline.py", "tests/pipeline/test_warm_restart.py",
)  # fmt: skip


class Tried(NamedTuple):
    """One round."""

    serial_bytes: int = 0
    can_messages: int = 0
    examples: int = 0
    failures: int = 0


def serial_round(seed: int) -> Tried:
    dice, decoder, last, sent = random.Random(seed), AdcDecoder(4, 1000), -1, 0
    for t_ns, data in mutated_stream(ROUND_FRAMES, dice):
        data = data if dice.random() < 0.8 else dice.randbytes(dice.randrange(60))
        sent += len(data)
        for item in adc_items(decoder, t_ns, data):
            if isinstance(item, AdcSample):
                assert item.counts == (item.sequence & 0xFFFF, -item.sequence & 0xFFFF, 0, 7), (seed, item)
                assert item.sequence > last, (seed, item)
                last = item.sequence
            else:
                assert item.kind in FAULT_KINDS
    return Tried(serial_bytes=sent)


def can_round(seed: int) -> Tried:
    table = CanTable.from_dbc(DBC_TEXT, ICD_INPUT_ROWS, CanUnits())
    decoder, dice = CanDecoder(table), random.Random(seed)
    idents = [*table.messages, 0, 1850, 2047]
    for step in range(ROUND_MESSAGES):
        data = dice.randbytes(dice.choice((8, 8, 8, 8, 8, 0, 4, 7, 64)))
        if dice.random() < 0.7:
            value = dice.choice((dice.gauss(0, 1), dice.uniform(-1e9, 1e9), float("inf"), float("nan"), 0.0))
            data = struct.pack(">BBBBf", 1, dice.choice((2, 2, 2, 7)), 0, step // len(idents) & 255, value)
        for item in can_items(decoder, Frame(step * 300_000, "can", dice.choice(idents), data)):
            assert isinstance(item, Fault) or item.value - item.value == 0, (seed, item)
    return Tried(can_messages=ROUND_MESSAGES)


def property_round(seed: int) -> Tried:
    options = ["-q", "-m", "hypothesis", "-p", "no:cacheprovider", "--hypothesis-profile=long",
               f"--hypothesis-seed={seed}", "--hypothesis-show-statistics"]  # fmt: skip
    command = [sys.executable, "-m", "pytest", *options, *PROPERTIES]
    answer = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, env={**os.environ, "PYTHONHASHSEED": "0"}
    )
    tried = re.findall(r"(\d+) passing(?: examples)?, (\d+) failing", answer.stdout)
    if answer.returncode != 0:
        print(answer.stdout[-4000:])
    return Tried(examples=sum(int(passed) for passed, _ in tried), failures=int(answer.returncode != 0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(1 << 30))
    arguments = parser.parse_args()
    rounds: tuple[Callable[[int], Tried], ...] = (serial_round, can_round, property_round)
    total, seed, begin_s, first_kb = Tried(), arguments.seed, time.monotonic(), 0
    with Progress() as progress:
        task = progress.add_task("fuzzing", total=arguments.minutes * 60)
        while time.monotonic() - begin_s < arguments.minutes * 60:
            for turn in rounds:
                total = Tried(*map(sum, zip(total, turn(seed), strict=True)))
                progress.update(task, completed=time.monotonic() - begin_s)
            first_kb = first_kb or resident_kb()
            seed += 1
    print(f"{(time.monotonic() - begin_s) / 60:.1f} min, seeds {arguments.seed} to {seed - 1}: "
          f"{total.serial_bytes} serial bytes, {total.can_messages} CAN messages, {total.examples} examples of "
          f"properties; {total.failures} rounds failed; memory after the first round {first_kb / 1000:.0f} MB, "
          f"at the end {resident_kb() / 1000:.0f} MB")  # fmt: skip
    sys.exit(total.failures > 0)


if __name__ == "__main__":
    main()
