//! A ROS domain for one test.

use std::env;
use std::fs::{self, File, TryLockError};
use std::path::PathBuf;
use std::process;

use ros::{DiscoveryRange, Node, NodeOptions};

/// Domains whose ports (7400 + 250 x domain) stay below the range that the kernel hands out by itself.
const DOMAINS: std::ops::RangeInclusive<u16> = 1..=100;

/// A ROS domain that no other test on this machine uses, on this host alone.
///
/// It is held by a lock on `rakelight_domains/NN.lock` in the folder for temporary files. The rclpy tests take theirs
/// in the same way. The kernel gives the lock back when the holder dies.
pub struct Domain {
    number: u16,
    _lock: File,
}

impl Domain {
    /// Takes a free domain.
    ///
    /// # Panics
    ///
    /// When all are in use.
    pub fn claim() -> Self {
        let folder = lock_folder();
        fs::create_dir_all(&folder).expect("the folder of the locks can be made");
        // Neighbouring processes begin at different places, so that they rarely ask for the same one.
        let count = DOMAINS.end() - DOMAINS.start() + 1;
        let first = (process::id().wrapping_mul(7) % u32::from(count)) as u16;
        (0..count)
            .find_map(|offset| Self::take(&folder, DOMAINS.start() + (first + offset) % count))
            .unwrap_or_else(|| {
                panic!(
                    "all of the ROS domains {DOMAINS:?} are in use: see {}",
                    folder.display()
                )
            })
    }

    fn take(folder: &std::path::Path, number: u16) -> Option<Self> {
        let path = folder.join(format!("{number:02}.lock"));
        let lock = File::options()
            .append(true)
            .create(true)
            .open(&path)
            .expect("a lock file can be opened");
        match lock.try_lock() {
            Ok(()) => Some(Self { number, _lock: lock }),
            Err(TryLockError::WouldBlock) => None,
            Err(TryLockError::Error(error)) => panic!("cannot lock {}: {error}", path.display()),
        }
    }

    /// The ROS domain id.
    pub fn number(&self) -> u16 {
        self.number
    }

    /// Options of a node in this domain.
    pub fn options(&self, name: &str) -> NodeOptions {
        NodeOptions::new(name)
            .namespace("/cell")
            .domain_id(self.number)
            .discovery_range(DiscoveryRange::Localhost)
    }

    /// A node `/cell/name` in this domain.
    ///
    /// # Panics
    ///
    /// When it cannot start.
    pub async fn node(&self, name: &str) -> Node {
        Node::start(self.options(name)).await.expect("a node starts")
    }

    /// Variables that put a process into this domain and keep it on this host.
    pub fn environment(&self) -> [(&'static str, String); 2] {
        [
            ("ROS_DOMAIN_ID", self.number.to_string()),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST".to_owned()),
        ]
    }

    /// The UDP ports on which the first `participants` participants of this domain listen (RTPS 9.6.1.1).
    pub fn ports(&self, participants: u16) -> Vec<u16> {
        let base = 7400 + 250 * self.number;
        let unicast = (0..participants).flat_map(|index| [base + 10 + 2 * index, base + 11 + 2 * index]);
        [base, base + 1].into_iter().chain(unicast).collect()
    }
}

fn lock_folder() -> PathBuf {
    env::temp_dir().join("rakelight_domains")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_tests_never_share_a_domain() {
        let (first, second) = (Domain::claim(), Domain::claim());
        assert_ne!(first.number(), second.number());
        let number = first.number();
        assert!(Domain::take(&lock_folder(), number).is_none());
    }

    #[test]
    fn ports_are_those_of_rtps() {
        let ports = Domain {
            number: 2,
            _lock: tempfile::tempfile().unwrap(),
        }
        .ports(2);
        assert_eq!(ports, [7900, 7901, 7910, 7911, 7912, 7913]);
    }
}
