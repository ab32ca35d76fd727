"""`python -m benchmarks [NAME ...]`: every short benchmark, or the named ones. Long ones have targets of their own."""

import sys
from importlib import import_module

SHORT = ("bench_model", "bench_flight", "bench_live", "bench_identify", "bench_zoom")


def main() -> None:
    chosen = [word for word in sys.argv[1:] if word.startswith("bench_")]
    if not set(chosen) <= set(SHORT) or (sys.argv[1:] and not chosen):
        sys.exit(f"benchmarks: {' '.join(sys.argv[1:])}: expected of {', '.join(SHORT)}")
    for name in chosen or SHORT:
        import_module(f"benchmarks.{name}").main()


if __name__ == "__main__":
    main()
