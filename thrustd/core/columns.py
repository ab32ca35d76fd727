"""How events and what was decoded of them travel in columns: the numbers that compiled code knows them by."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]
Floats = NDArray[np.float64]

# kinds of events; every other one is a channel's number
TICK: Final = 255
FAULT: Final = 254

# rows decoded of frames: event | kind | ...; kind 0 is what was hoped for, any other a fault
EVENT, KIND = range(2)
GOOD: Final = 0
SLOT = 2  # of a reading: which of the signals that are heard; its value is in a column of its own
SEQUENCE, DEVICE_US, COUNTS = range(2, 5)  # of an ADC sample; one column of counts per channel
PLACE, COUNT = range(2, 4)  # of a fault: channel, message or signal; how many
CHANNEL_FAULT: Final = 0x7FFFFFFF  # counts of an open or shorted transducer

MOUNT_STATE = np.dtype(  # one mount at one fused step, means over the samples since the last; NaN: no sample
    [
        ("deformation_mm", np.float64),
        ("force_n", np.float64),
        ("std_n", np.float64),
        ("common_n", np.float64),  # the part of it that the engine's other mount has too, to the same side
        ("extrapolating", np.bool_),
        ("gap", np.bool_),
    ],
    align=True,
)
