//! Checks that this processor supports the instructions that the program was compiled for.
//!
//! The whole program is compiled for x86-64-v3 (or for `target-cpu`), so on an older processor it would be killed by SIGILL.
//! `is_x86_feature_detected!` does not help: for a feature enabled at compile time it is the constant `true`. So this module
//! calls `cpuid` itself, and nothing in it may compile to an instruction that it checks for. Not even `1 << bit` may: that
//! became `shlx` of BMI2, and `word & mask == mask` may become `andn` of BMI1. Hence no formatting, no copies of arrays, and
//! the only arithmetic in assembly. `.ci/run` tests the program on an emulated Nehalem where qemu is installed.

use std::arch::asm;
use std::arch::x86_64::{__cpuid_count, CpuidResult};
use std::io::Write;

/// The `cpuid` register of a feature's bit.
#[derive(Clone, Copy)]
enum Leaf {
    /// `cpuid` leaf 1, register ecx.
    OneEcx,
    /// `cpuid` leaf 7, register ebx.
    SevenEbx,
    /// `cpuid` leaf 0x8000_0001, register ecx.
    ExtendedEcx,
}

/// A required feature.
struct Feature {
    name: &'static str,
    leaf: Leaf,
    /// The one bit in the leaf's word.
    mask: u32,
    /// The bits of XCR0 that the operating system must set to save the feature's registers at a task switch.
    saved: u32,
    /// Whether this build may use it.
    compiled: bool,
}

macro_rules! features {
    ($($name:literal: $feature:literal, $leaf:ident $bit:literal, $saved:expr;)*) => {
        [$(Feature {
            name: $name,
            leaf: Leaf::$leaf,
            mask: 1 << $bit,
            saved: $saved,
            compiled: cfg!(target_feature = $feature),
        }),*]
    };
}

/// XMM and YMM registers.
const YMM: u32 = 0b110;
/// YMM, the mask registers and ZMM.
const ZMM: u32 = 0b1110_0110;

/// Intel's manual, volume 2, CPUID; AMD's, volume 3, appendix E. Includes what `target-cpu=native` adds most often.
static FEATURES: [Feature; 14] = features! {
    "SSE4.2": "sse4.2", OneEcx 20, 0;
    "MOVBE": "movbe", OneEcx 22, 0;
    "POPCNT": "popcnt", OneEcx 23, 0;
    "AVX": "avx", OneEcx 28, YMM;
    "F16C": "f16c", OneEcx 29, YMM;
    "FMA": "fma", OneEcx 12, YMM;
    "BMI1": "bmi1", SevenEbx 3, 0;
    "AVX2": "avx2", SevenEbx 5, YMM;
    "BMI2": "bmi2", SevenEbx 8, 0;
    "LZCNT": "lzcnt", ExtendedEcx 5, 0;
    "AVX-512F": "avx512f", SevenEbx 16, ZMM;
    "AVX-512DQ": "avx512dq", SevenEbx 17, ZMM;
    "AVX-512BW": "avx512bw", SevenEbx 30, ZMM;
    "AVX-512VL": "avx512vl", SevenEbx 31, ZMM;
};

/// Whether this processor and its operating system support all features of the build; if not, prints what is missing in one
/// sentence on standard error. Call before anything else.
#[must_use]
#[inline(never)]
pub fn suffices() -> bool {
    let state = saved_state();
    let mut missing = 0;
    for feature in &FEATURES {
        if feature.compiled && !has(feature, state) {
            say(if missing == 0 {
                "error: this processor (or its operating system) has no "
            } else {
                ", "
            });
            say(feature.name);
            missing += 1;
        }
    }
    if missing > 0 {
        say("; Octolux needs x86-64-v3 (Intel Haswell of 2013, AMD Excavator of 2015, or later), ");
        say("or a build for this machine with ");
        say("RUSTFLAGS=\"-C target-cpu=native\"\n");
    }
    missing == 0
}

fn has(feature: &Feature, state: u32) -> bool {
    let word = match feature.leaf {
        Leaf::OneEcx => cpuid(1).ecx,
        Leaf::SevenEbx if cpuid(0).eax >= 7 => cpuid(7).ebx,
        Leaf::ExtendedEcx if cpuid(0x8000_0000).eax >= 0x8000_0001 => cpuid(0x8000_0001).ecx,
        _ => 0,
    };
    covers(word, feature.mask) && covers(state, feature.saved)
}

/// Whether all bits of `mask` are set in `word`; the module documentation says why this is in assembly.
fn covers(word: u32, mask: u32) -> bool {
    let yes: u8;
    // SAFETY: three instructions on registers that every x86-64 has; they change nothing but those and the flags.
    unsafe {
        asm!("and {word:e}, {mask:e}", "cmp {word:e}, {mask:e}", "sete {yes}",
            word = inout(reg) word => _, mask = in(reg) mask, yes = out(reg_byte) yes, options(pure, nomem, nostack));
    }
    yes != 0
}

/// The lower half of register XCR0: which register files the operating system saves. 0 if not reported.
fn saved_state() -> u32 {
    const OSXSAVE: u32 = 1 << 27;
    if !covers(cpuid(1).ecx, OSXSAVE) {
        return 0;
    }
    let state: u32;
    // SAFETY: OSXSAVE means that `xgetbv` may be executed; register 0 exists then. In assembly, since the intrinsic requires
    // the target feature `xsave`.
    unsafe { asm!("xgetbv", in("ecx") 0, out("eax") state, out("edx") _, options(nomem, nostack, preserves_flags)) };
    state
}

fn cpuid(leaf: u32) -> CpuidResult {
    // A safe function in rustc 1.95, an unsafe one in the oldest supported Rust.
    #[allow(unused_unsafe)]
    // SAFETY: every x86-64 processor has `cpuid`.
    unsafe {
        __cpuid_count(leaf, 0)
    }
}

/// Writes with the precompiled standard library, which targets baseline x86-64; `eprintln!` would be compiled here.
fn say(text: &str) {
    let _ = std::io::stderr().write(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_machine_that_runs_this_suffices() {
        assert!(suffices());
    }

    #[test]
    fn the_bits_agree_with_the_standard_library() {
        // Constant for features enabled at compile time, a real check for others (AVX-512 in a default build).
        let state = saved_state();
        let expected = |name| match name {
            "AVX2" => is_x86_feature_detected!("avx2"),
            "FMA" => is_x86_feature_detected!("fma"),
            "AVX-512F" => is_x86_feature_detected!("avx512f"),
            "AVX-512DQ" => is_x86_feature_detected!("avx512dq"),
            "AVX-512BW" => is_x86_feature_detected!("avx512bw"),
            "AVX-512VL" => is_x86_feature_detected!("avx512vl"),
            _ => true,
        };
        for feature in &FEATURES {
            assert_eq!(has(feature, state), expected(feature.name), "{}", feature.name);
        }
    }
}
