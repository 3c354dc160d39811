//! What this process may do and ignores.

use std::fs;

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Lets this process have so many endpoints and hosts more than it already has, as far as the system allows: it counts files.
pub fn allow_many_endpoints(files: usize) {
    let limit = getrlimit(Resource::Nofile);
    let wanted = limit.current.unwrap_or(u64::MAX).saturating_add(files as u64);
    let current = limit.maximum.map_or(wanted, |most| most.min(wanted));
    // What is refused is missed when a file cannot be opened.
    let _ = setrlimit(Resource::Nofile, Rlimit { current: Some(current), ..limit });
}

/// Whether this process ignores a signal, where the system tells it in `/proc`.
pub(crate) fn is_ignored(signal: i32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok()).unwrap_or(0);
    mask & 1 << (signal - 1) != 0
}
