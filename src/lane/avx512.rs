//! AVX-512, for processors that have it: chosen when the program runs.
//!
//! All that handles lanes is inlined into [`with_avx512`], the only place where the compiler may use the instructions. Sixteen
//! lanes exist there alone. Eight are the same type as without, with 32 registers instead of sixteen.

use std::sync::LazyLock;

/// The environment variable that leaves AVX-512 unused where it is `off`, as on a processor that lacks it. When the program is built, it
/// decides whether kernels for AVX-512 are compiled (`build.rs`).
pub const AVX512: &str = "OCTOLUX_AVX512";

/// Work for lanes. `run` must be `#[inline(always)]`, and so must everything in it that handles them.
pub trait Work {
    /// Does the work.
    fn run(self);
}

/// Whether kernels for AVX-512 were compiled, this processor has what they need, and [`AVX512`] is not `off`.
pub fn has_avx512() -> bool {
    static HAS: LazyLock<bool> = LazyLock::new(|| {
        cfg!(avx512_kernels)
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && std::env::var_os(AVX512).is_none_or(|value| value != "off")
    });
    *HAS
}

/// Runs work with AVX-512.
///
/// # Panics
/// If [`has_avx512`] says no: ask it before making such work.
#[inline]
pub fn with_avx512<W: Work>(work: W) {
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
    fn inner<W: Work>(work: W) {
        work.run();
    }
    assert!(
        has_avx512(),
        "AVX-512 is not there, left out by the build, or switched off"
    );
    if cfg!(avx512_kernels) {
        // SAFETY: the processor has the instructions, as just asserted.
        unsafe { inner(work) }
    }
}
