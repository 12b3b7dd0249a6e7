"""Refuses a processor that cannot run the module, in place of the kernel, which would end the process."""

from pathlib import Path

NEEDED = {"avx2", "fma", "bmi1", "bmi2", "movbe", "f16c"}

try:
    _flags = next(line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("flags"))
except (OSError, StopIteration):
    pass
else:
    if missing := NEEDED - set(_flags.split()):
        raise ImportError(
            f"octolux needs a processor with AVX2 and FMA, and this one lacks {', '.join(sorted(missing))}"
        )
