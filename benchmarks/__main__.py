"""`python -m benchmarks [NAME ...]`: every short benchmark, or the named ones. Long ones have targets of their own."""

import sys
from importlib import import_module

SHORT = ("bench_model", "bench_flight", "bench_live", "bench_wire", "bench_log", "bench_identify", "bench_zoom")


def main() -> None:
    chosen = [word for word in sys.argv[1:] if word in SHORT] or SHORT
    for name in chosen:
        import_module(f"benchmarks.{name}").main()


if __name__ == "__main__":
    main()
