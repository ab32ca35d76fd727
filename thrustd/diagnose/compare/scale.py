"""Whether a recording is of a mount like those of PH-LAB, so that what is known of these says anything about it."""

from collections.abc import Sequence

import numpy as np

from thrustd.identify.segments import DEFORMATION, FORCE
from thrustd.records.recording import Recording
from thrustd.records.roles import roles_of

FULL_N, FULL_MM = 6500.0, 1.3  # load and travel of a PH-LAB mount at full thrust
ORDER = 3.0  # times more or less is another order of magnitude


def is_phlab_size(records: Sequence[Recording]) -> bool:
    """A mount's file, in millimetres and newtons, of a PH-LAB mount's order of magnitude in both."""
    if not records or not roles_of(records).own:
        return False
    return all(_alike(records, name, full) for name, full in ((FORCE, FULL_N), (DEFORMATION, FULL_MM)))


def _alike(records: Sequence[Recording], name: str, full: float) -> bool:
    columns = [column[np.isfinite(column)] for record in records if name in record for column in (record[name],)]
    seen = np.abs(np.concatenate(columns)) if columns else np.array([])
    return bool(seen.size) and full / ORDER <= float(np.quantile(seen, 0.999)) <= full * ORDER
