"""Noises, gates and time constants of the fusion: the `[fusion]` section of the configuration."""

from typing import Any

import msgspec
import numpy as np

from thrustd.core.errors import ConfigError


class FusionSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All one sigma unless named otherwise. Where each default comes from: docs/fusion.md."""

    # thrust moves: first-order Gauss-Markov rate, its strength follows the throttle
    thrust_rate_std_n_s: float = 15.0  # steady flight: 12 to 17
    thrust_rate_tau_s: float = 1.3  # time constant of the thrust rate
    throttle_rate_gain_n_per_pct: float = 600.0  # twice the thrust per per cent of N1 at high power, JT15D-4
    surprise_rate_n_s: float = 600.0  # after one source was gated out
    agreed_surprise_rate_n_s: float = 4000.0  # after every source that speaks was: the thrust moves before N1 says so
    # white noise of one measurement
    mount_noise_std_n: float = 5.2  # of the longitudinal acceleration: 373 kg times 0.002 g / sqrt 2
    brochure_noise_std_n: float = 5.0  # of fuel flow and N1 behind the hand-over
    # slow errors of both sources: how large, how long they last, and the thrust movement after which they are others
    mount_zero_std_mm: float = 0.004  # one transducer in the aircraft: calibrating the zero takes it off
    mount_stiffness_std: float = 0.003  # of one mount against its bench, relative
    mount_friction_std_n: float = 8.0  # the same; sigma of the mounts' source: all three and the model's error map
    mount_error_tau_s: float = 600.0  # time constant of the slow error of the mounts
    brochure_bias_std: float = 0.02  # engine against deck, relative: 95 % of them are within 4 %
    brochure_bias_tau_s: float = 7200.0  # time constant of the engine's deviation from the deck
    brochure_shape_tau_s: float = 600.0  # the rest of the deck's spread
    forget_after_n: float = 3000.0  # movement of the thrust after which the slow errors are new ones
    # gates
    gate_chi2: float = 15.1  # chi-square with one degree of freedom, one false alarm in 10 000
    # engine off
    engine_off_n1_pct: float = 5.0  # an engine that is off turns no faster, standing on the ground
    engine_off_after_s: float = 3.0  # once nobody has said for so long that it runs
    engine_off_std_n: float = 10.0  # of the zero thrust of an engine that is off
    converging_std_n: float = 400.0  # band wider than this: still converging


SETTINGS = np.dtype([(name, np.float64) for name in FusionSettings.__struct_fields__])


def settings_row(settings: FusionSettings) -> Any:
    """(1,) of SETTINGS: the same for compiled code."""
    return np.array([msgspec.structs.astuple(settings)], SETTINGS)


def check_settings(settings: FusionSettings, where: str) -> None:
    """Every number of a size that can be meant, else a ConfigError that names the key."""
    for name in settings.__struct_fields__:
        value = getattr(settings, name)
        if not 1e-9 < value < 1e9:
            raise ConfigError(f"{where}: fusion.{name} = {value}: expected 1e-9 to 1e9")
