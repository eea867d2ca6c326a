"""Settings with which numpy, numba and the C library use the abilities of other processors than this one."""

from __future__ import annotations

import numpy._core._multiarray_umath as numpy_features  # not public: numpy has no other list of its routines

SIMD = [name for name in numpy_features.__cpu_dispatch__ if numpy_features.__cpu_features__[name]]
"""Vector routines of numpy above its baseline that this processor has."""

SETTINGS: dict[str, dict[str, str]] = {
    "without AVX-512": {
        "NPY_DISABLE_CPU_FEATURES": " ".join(name for name in SIMD if "512" in name or name == "X86_V4")
    },
    "numpy's baseline": {"NPY_DISABLE_CPU_FEATURES": " ".join(SIMD)},
    "machine code for any processor": {"NUMBA_CPU_NAME": "generic"},
    "C library and BLAS without FMA": {
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX2_Usable,-FMA_Usable",
        "OPENBLAS_CORETYPE": "Prescott",
    },
}
"""Environment variables by the name of the setting."""

SETTINGS["numpy's baseline, C library and BLAS without FMA"] = {
    **SETTINGS["numpy's baseline"],
    **SETTINGS["C library and BLAS without FMA"],
}

TOGETHER = "without AVX-512", "numpy's baseline, C library and BLAS without FMA"
"""Settings that no machine code has to be compiled for, and that have every difference of the others."""
