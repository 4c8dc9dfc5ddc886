//! What the kernel grants: socket buffers, capabilities, limits. Files are read below a root, so that tests have theirs.

use std::fs;
use std::path::Path;

use rustix::process::{Resource, Rlimit, getrlimit};

use super::finding::{Finding, Section};

const NETWORK: Section = Section("network");
const SYSTEM: Section = Section("system");

/// A whole frame of 1536 x 1536 pixels of 16 bits and its packets' headers fit.
const WANTED_BUFFER: u64 = 8 << 20;

/// Positions in the kernel's set of capabilities.
const CAP_NET_RAW: u32 = 13;
const CAP_SYS_NICE: u32 = 23;

/// A node opens 50 to 100 files, a process of ten nodes up to 1000.
const WANTED_FILES: u64 = 4096;

/// A capture of both cameras is 75 MB before it is compressed.
const WANTED_SPACE: u64 = 5 << 30;

pub(super) fn check(root: &Path, folder: &Path) -> Vec<Finding> {
    let capabilities = capabilities(root);
    vec![
        socket_buffers(root),
        packet_socket(capabilities),
        open_files(getrlimit(Resource::Nofile)),
        real_time(getrlimit(Resource::Rtprio), getrlimit(Resource::Memlock), capabilities),
        disk_space(folder),
    ]
}

/// A number in a file below `/proc`.
fn number(root: &Path, path: &str) -> Option<u64> {
    fs::read_to_string(root.join(path)).ok()?.trim().parse().ok()
}

fn socket_buffers(root: &Path) -> Finding {
    let what = "socket buffers";
    let most = number(root, "proc/sys/net/core/rmem_max");
    let usual = number(root, "proc/sys/net/core/rmem_default");
    let (Some(most), Some(usual)) = (most, usual) else {
        return NETWORK.warn(what, "the kernel does not tell", "look at `sysctl net.core.rmem_max`");
    };
    let found = format!("{most} bytes at most, {usual} by default");
    if most >= WANTED_BUFFER {
        return NETWORK.ok(what, found);
    }
    let advice = format!(
        "works, slower: cameras pause between packets, large messages are repaired. For whole frames: \
         sudo sysctl -w net.core.rmem_max={WANTED_BUFFER}"
    );
    NETWORK.warn(what, found, advice)
}

/// The effective capabilities of this process.
fn capabilities(root: &Path) -> Option<u64> {
    let status = fs::read_to_string(root.join("proc/self/status")).ok()?;
    let mask = status.lines().find_map(|line| line.strip_prefix("CapEff:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}

fn has(capabilities: Option<u64>, bit: u32) -> bool {
    capabilities.is_some_and(|mask| mask >> bit & 1 == 1)
}

fn packet_socket(capabilities: Option<u64>) -> Finding {
    let what = "packet socket";
    if has(capabilities, CAP_NET_RAW) {
        return NETWORK.ok(what, "allowed (CAP_NET_RAW): frames come past the kernel's UDP");
    }
    let advice = "works, slower, over UDP. For the packet socket: sudo setcap cap_net_raw+ep PATH/TO/rakelight";
    NETWORK.warn(what, "not allowed (no CAP_NET_RAW)", advice)
}

fn in_words(limit: Option<u64>) -> String {
    limit.map_or_else(|| "unlimited".into(), |limit| limit.to_string())
}

fn open_files(limit: Rlimit) -> Finding {
    let what = "open files";
    let most = limit.maximum;
    let found = format!("{} at most; raised at start", in_words(most));
    if most.is_none_or(|most| most >= WANTED_FILES) {
        return SYSTEM.ok(what, found);
    }
    let advice = "a node needs about 100: raise `nofile` in /etc/security/limits.conf";
    SYSTEM.warn(what, found, advice)
}

/// For the arm's servo loop; lights and cameras are timed by their own hardware.
fn real_time(priority: Rlimit, memory: Rlimit, capabilities: Option<u64>) -> Finding {
    let allowed = has(capabilities, CAP_SYS_NICE) || priority.current.is_none_or(|limit| limit > 0);
    let found = format!(
        "{}, rtprio {}, memlock {}: lights and cameras need neither",
        if allowed { "allowed" } else { "not allowed" },
        in_words(priority.current),
        in_words(memory.current)
    );
    SYSTEM.ok("real-time threads", found)
}

fn disk_space(folder: &Path) -> Finding {
    let what = "disk space";
    let free = match rustix::fs::statvfs(folder) {
        Ok(volume) => volume.f_bavail.saturating_mul(volume.f_frsize),
        Err(error) => return SYSTEM.warn(what, error.to_string(), "start where bags are to be written"),
    };
    let found = format!("{:.1} GB free here", free as f64 / 1e9);
    if free >= WANTED_SPACE {
        return SYSTEM.ok(what, found);
    }
    SYSTEM.warn(
        what,
        found,
        "a capture takes up to 75 MB in a bag: record on another volume",
    )
}

#[cfg(test)]
mod tests {
    use super::super::finding::Status;
    use super::*;

    /// A root with these files.
    fn root(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (path, text) in files {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        root
    }

    #[test]
    fn small_socket_buffers_are_a_warning_with_the_command_that_helps() {
        let with = |most: &str| {
            let files = [
                ("proc/sys/net/core/rmem_max", most),
                ("proc/sys/net/core/rmem_default", "212992\n"),
            ];
            socket_buffers(root(&files).path())
        };
        let small = with("212992\n");
        assert_eq!(small.status, Status::Warn);
        assert_eq!(small.found, "212992 bytes at most, 212992 by default");
        assert!(small.advice.unwrap().contains("rmem_max=8388608"));
        assert_eq!(with("8388608\n").status, Status::Ok);
        assert_eq!(socket_buffers(root(&[]).path()).found, "the kernel does not tell");
    }

    #[test]
    fn capabilities_are_read_from_the_kernels_mask() {
        let of = |mask: &str| capabilities(root(&[("proc/self/status", mask)]).path());
        let raw = of("Name:\trakelight\nCapEff:\t0000000000002000\n");
        assert_eq!(packet_socket(raw).status, Status::Ok);
        assert!(!has(raw, CAP_SYS_NICE));
        assert_eq!(packet_socket(of("CapEff:\t0000000000000000\n")).status, Status::Warn);
        assert_eq!(packet_socket(of("Name:\tx\n")).status, Status::Warn);
    }

    #[test]
    fn limits_are_told_in_words() {
        let limit = |most| Rlimit {
            current: most,
            maximum: most,
        };
        assert_eq!(open_files(limit(None)).found, "unlimited at most; raised at start");
        assert_eq!(open_files(limit(Some(1024))).status, Status::Warn);
        let found = real_time(limit(Some(0)), limit(Some(65_536)), Some(0)).found;
        assert_eq!(
            found,
            "not allowed, rtprio 0, memlock 65536: lights and cameras need neither"
        );
    }
}
