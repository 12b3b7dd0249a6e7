//! Memory prefetching.

use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

/// Prefetches a value into the L1 cache. Has no other effect.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    let first = std::ptr::from_ref(value).cast::<i8>();
    let last = first.wrapping_add(size_of::<T>().saturating_sub(1));
    // SAFETY: a hint about addresses, which it does not read from; any will do. A value of up to 64 bytes lies on the lines of
    // its first byte and its last.
    unsafe {
        _mm_prefetch::<_MM_HINT_T0>(first);
        _mm_prefetch::<_MM_HINT_T0>(last);
    }
}
