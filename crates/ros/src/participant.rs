//! Joining a ROS domain.

use std::net::Ipv4Addr;
use std::sync::Once;

use rustdds::{DomainParticipant, DomainParticipantBuilder};

use crate::error::Error;
use crate::options::DiscoveryRange;

/// A node opens 50 to 100 files; a process of ten nodes passes the usual soft limit of 1024.
const OPEN_FILES_WANTED: u64 = 65_536;

/// One DDS participant, for one node.
pub(crate) fn join(domain_id: u16, range: DiscoveryRange) -> Result<DomainParticipant, Error> {
    raise_open_file_limit();
    let builder = DomainParticipantBuilder::new(domain_id);
    let builder = match range {
        DiscoveryRange::Localhost => builder.with_only_networks([Ipv4Addr::LOCALHOST]),
        DiscoveryRange::Subnet => builder,
    };
    builder.build().map_err(|e| Error::Participant {
        domain_id,
        reason: e.to_string(),
    })
}

fn raise_open_file_limit() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| match rlimit::increase_nofile_limit(OPEN_FILES_WANTED) {
        Ok(limit) if limit < 1024 => tracing::warn!(limit, "few open files are allowed; a node needs about 100"),
        Ok(_) => {}
        Err(error) => tracing::warn!(%error, "cannot raise the limit of open files; a node needs about 100"),
    });
}
