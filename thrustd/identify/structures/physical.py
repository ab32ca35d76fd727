"""Physical structures: springs and dashpots (thesis section 13.1), parameters estimated instead of tuned by hand.

maxwell              spring and dashpot in series: relaxes to no force at all
kelvin-voigt         spring and dashpot in parallel (the dashpot behind a 0.1 s lag, as no sensor gives a true rate)
zener                spring in parallel with one Maxwell branch (standard linear solid)
generalised-maxwell  cubic spring in parallel with three Maxwell branches (Prony series)
"""

from collections.abc import Sequence

from thrustd.identify.regression.solve import Progress
from thrustd.identify.segments import Segment
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.rheology import fit_branches
from thrustd.identify.structures.structure import Fitted, Structure

RATE_LAG_S = 0.1


def _structure(name: str, title: str, powers: tuple[int, ...], free: int, fixed: tuple[float, ...] = ()) -> Structure:
    def fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
        branches = fit_branches(segments, powers, free, fixed)
        return Fitted(1 + len(powers) + 2 * free + len(fixed), branches.simulate)

    return Structure(name, title, "physical", fit)


STRUCTURES = (
    _structure("maxwell", "Maxwell", (), 1),
    _structure("kelvin-voigt", "Kelvin-Voigt", (1,), 0, (RATE_LAG_S,)),
    _structure("zener", "standard linear solid (Zener)", (1,), 1),
    _structure("generalised-maxwell", "generalised Maxwell, nonlinear spring", (1, 2, 3), 3),
)
