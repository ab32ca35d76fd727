"""Newtons as people read them: a decimal for a mount of kilonewtons, two digits for a strip of rubber below one."""


def newtons(value_n: float, sign: str = "", decimals: int = 1) -> str:
    """12.3 or 0.17; `sign` "+" shows it always."""
    return f"{value_n:{sign}.{decimals}f}" if abs(value_n) >= 1.0 else f"{value_n:{sign}.2g}"
