"""Newtons as people read them: a decimal for a mount of kilonewtons, two digits for a strip of rubber below one."""


def newtons(value_n: float, sign: str = "", decimals: int = 1, unit: str = "") -> str:
    """12.3 or 0.17; `sign` "+" shows it always; `unit` behind it, where the output has one that is known."""
    number = f"{value_n:{sign}.{decimals}f}" if abs(value_n) >= 1.0 else f"{value_n:{sign}.2g}"
    return f"{number} {unit}" if unit else number
