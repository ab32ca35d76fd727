"""When a sensor may rest without being stuck; what a healthy one never does is in the aircraft's own file."""

ALONE_STUCK_S = 1.0  # the engine's other two signals moved, and this one did not by one bit
SAT_CLIMB_M = 400.0  # SAT that has not moved while the aircraft climbed or sank this far is stuck
FLYING_MACH = 0.12  # on the ground Mach and accelerations may rest at one value
TURNING_N1_PCT = 20.0  # below: the engine is off or starting, its sensors may rest
