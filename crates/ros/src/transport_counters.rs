//! What a node's transport has lost, for its diagnostics.

use std::sync::Weak;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::diagnostics::Status;
use crate::graph::Graph;

/// Counts since the node's start.
#[derive(Debug, Default)]
pub(crate) struct TransportCounters {
    dropped: AtomicU64,
    unreadable: AtomicU64,
}

impl TransportCounters {
    /// A message gave way because its subscription was slow.
    pub(crate) fn count_dropped(&self) {
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }

    /// A message, request or reply could not be decoded.
    pub(crate) fn count_unreadable(&self) {
        self.unreadable.fetch_add(1, Ordering::Relaxed);
    }

    /// A warning follows only on what is unreadable: to drop old messages is what keep-last is for.
    fn status(&self, reported: &mut u64, other_nodes: usize) -> Status {
        let (dropped, unreadable) = (
            self.dropped.load(Ordering::Relaxed),
            self.unreadable.load(Ordering::Relaxed),
        );
        let new = unreadable - std::mem::replace(reported, unreadable);
        let status = match new {
            0 => Status::ok("nothing unreadable"),
            new => Status::warn(format!("{new} unreadable since the last report")),
        };
        status
            .value("other nodes", other_nodes, "")
            .value("dropped in hand-over", dropped, "messages")
            .value("unreadable", unreadable, "messages")
    }
}

/// The provider of the part "transport".
pub(crate) fn provider(graph: Weak<Graph>) -> impl FnMut() -> Status + Send + 'static {
    let mut reported = 0;
    move || match graph.upgrade() {
        Some(graph) => graph.counters.status(&mut reported, graph.other_nodes().len()),
        None => Status::stale("the node is gone"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unreadable_messages_warn_once_and_stay_counted() {
        let counters = TransportCounters::default();
        let mut reported = 0;
        let counted = |status: Status, unreadable: &str| {
            status
                .value("other nodes", 2, "")
                .value("dropped in hand-over", 1, "messages")
                .value("unreadable", unreadable, "")
        };
        counters.count_dropped();
        assert_eq!(
            counters.status(&mut reported, 2),
            counted(Status::ok("nothing unreadable"), "0 messages")
        );
        counters.count_unreadable();
        let expected = counted(Status::warn("1 unreadable since the last report"), "1 messages");
        assert_eq!(counters.status(&mut reported, 2), expected);
        assert_eq!(
            counters.status(&mut reported, 2),
            counted(Status::ok("nothing unreadable"), "1 messages")
        );
    }
}
