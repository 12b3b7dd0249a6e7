//! How much memory may be asked for.

/// Bytes that a program can still take without swapping; `None` where the system does not say.
pub(super) fn available() -> Option<u64> {
    // Linux: see proc_meminfo(5). Elsewhere there is no such file, and nothing is checked.
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

/// `true` if `bytes` fit into the memory that is free.
pub(super) fn fits(bytes: u64) -> bool {
    available().is_none_or(|free| bytes <= free)
}
