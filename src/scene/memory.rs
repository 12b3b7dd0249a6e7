//! Available memory.

use std::fs;
use std::path::Path;

/// Bytes that the process can allocate without swapping, limited by the machine and its control groups; `None` where the system
/// does not report it.
pub fn available() -> Option<u64> {
    // Linux: see proc_meminfo(5). Other systems lack this file, and nothing is checked.
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let group = groups
        .lines()
        .find_map(|line| line.strip_prefix("0::/"))
        .unwrap_or_default();
    let limits = Path::new("/sys/fs/cgroup").join(group);
    let limits = limits
        .ancestors()
        .take_while(|folder| folder.starts_with("/sys/fs/cgroup"));
    let all = limits.filter_map(left_in).chain(kib.checked_mul(1024));
    all.chain(address_space()).min()
}

/// What `ulimit -v` leaves of the address space; `None` without a limit.
fn address_space() -> Option<u64> {
    let number = |file: &str, name: &str| {
        let text = fs::read_to_string(file).ok()?;
        let line = text.lines().find_map(|line| line.strip_prefix(name))?;
        line.split_whitespace().next()?.parse::<u64>().ok()
    };
    let limit = number("/proc/self/limits", "Max address space")?;
    Some(limit.saturating_sub(1024 * number("/proc/self/status", "VmSize:")?))
}

/// The remaining limit of a control group (version 2; cgroups(7)). Cached files can be evicted, so they do not count.
fn left_in(group: &Path) -> Option<u64> {
    let number = |name: &str| fs::read_to_string(group.join(name)).ok()?.trim().parse::<u64>().ok();
    let (limit, used) = (number("memory.max")?, number("memory.current")?);
    let stat = fs::read_to_string(group.join("memory.stat")).unwrap_or_default();
    let cached = stat
        .lines()
        .find_map(|line| line.strip_prefix("inactive_file ")?.parse().ok())
        .unwrap_or(0);
    Some(limit.saturating_sub(used.saturating_sub(cached)))
}

/// Whether `bytes` fit into the free memory.
pub(super) fn fits(bytes: u64) -> bool {
    available().is_none_or(|free| bytes <= free)
}
