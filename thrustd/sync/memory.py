"""What alignment remembers between two events, as rows that compiled code and Python both read."""

import numpy as np

CLOCK = np.dtype(
    [
        ("known", np.int64),
        ("device_ns", np.int64),
        ("offset_ns", np.int64),
        ("rate", np.float64),  # by which our clock runs faster than the ADC's crystal, s/s
        ("last_rate", np.float64),  # by the last two windows
        ("found_rate", np.float64),  # as often as two of these agree; `rate` is that of a clock
        ("window_ns", np.int64),  # device time when this window began
        ("least", np.int64, 2),  # device time and delay of its sample that was least late
        ("anchor", np.int64, 2),  # the same of an earlier window; device time 0: there is none
    ]
)
HELD = np.dtype(  # the latest reading of one signal beside what the catalogue says of it
    [
        ("t_ns", np.int64),
        ("stale_after_ns", np.int64),
        ("known", np.int64),
        ("stale", np.int64),  # as last told
        ("trusted", np.int64),
        ("value", np.float64),
        ("low", np.float64),
        ("high", np.float64),
    ]
)
GRID = np.dtype(
    [
        ("t_ns", np.int64),  # of the last sample
        ("sequence", np.int64),
        ("resuming", np.int64),  # the first sample after a warm restart is still to come
        ("next_step", np.int64),  # sequence of the next fused step
        ("samples_per_step", np.int64),
        ("fused_ns", np.int64),  # of the last fused step; -1 before the first
        ("step_ns", np.float64),  # between two fused steps
        ("due_ns", np.int64),  # the instant of the step that is to be made
        ("offered_mm", np.float64),  # deformation of the sample a mount has to catch up with
    ]
)
MOUNT = np.dtype(
    [
        ("channel", np.int64),  # of the ADC
        ("scale_mm", np.float64),
        ("offset_mm", np.float64),
        ("low_mm", np.float64),  # what it can be brought to
        ("high_mm", np.float64),
        ("sequence", np.int64),  # of the last good sample
        ("watchful", np.int64),  # the next sample is not to be taken for the one after it
        ("waiting", np.int64),  # samples that its model has not seen yet
        ("beyond", np.int64),  # a sample was since it was last asked
        ("deformation_mm", np.float64),  # of the last good sample
    ]
)
