//! What the benchmarks say of memory.

/// The most memory that this process has had resident; empty where the system does not say.
pub(crate) fn peak_mib() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kib.map_or(String::new(), |kib| format!("{:.0}", kib / 1024.0))
}
