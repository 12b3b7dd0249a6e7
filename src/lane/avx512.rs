//! AVX-512, selected at run time if the processor has it.
//!
//! All code that handles lanes is inlined into [`with_avx512`], the only function in which the compiler may use these instructions.
//! Sixteen lanes exist only there. Eight lanes are the same type as without AVX-512, with 32 registers instead of sixteen.

use std::sync::LazyLock;

/// The environment variable that disables AVX-512 if it is `off`, as if the processor lacked it. At build time it determines
/// whether kernels for AVX-512 are compiled (`build.rs`).
pub const AVX512: &str = "OCTOLUX_AVX512";

/// Code that handles lanes. `run` must be `#[inline(always)]`, like everything in it that handles lanes.
pub trait Work {
    /// Runs the code.
    fn run(self);
}

/// Whether kernels for AVX-512 were compiled, this processor supports them, and [`AVX512`] is not `off`.
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

/// Runs code with AVX-512.
///
/// # Panics
/// If [`has_avx512`] is false. Check it before creating such work.
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
