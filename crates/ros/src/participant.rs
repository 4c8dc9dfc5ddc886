//! Joining a ROS domain.

use std::env;
use std::net::Ipv4Addr;
use std::sync::Once;

use rustdds::{DomainParticipant, DomainParticipantBuilder};

use crate::error::Error;
use crate::options::DiscoveryRange;

/// A node opens 50 to 100 files; a process of ten nodes passes the usual soft limit of 1024.
const OPEN_FILES_WANTED: u64 = 65_536;

/// Environment variable for the size of a node's socket buffers, in bytes. It serves to measure what smaller kernels do.
const SOCKET_BUFFER: &str = "RAKELIGHT_SOCKET_BUFFER_BYTES";
const MIN_SOCKET_BUFFER: usize = 65_536;
const MAX_SOCKET_BUFFER: usize = 1 << 30;

/// One DDS participant, for one node.
pub(crate) fn join(domain_id: u16, range: DiscoveryRange) -> Result<DomainParticipant, Error> {
    raise_open_file_limit();
    let builder = DomainParticipantBuilder::new(domain_id);
    let builder = match range {
        DiscoveryRange::Localhost => builder.with_only_networks([Ipv4Addr::LOCALHOST]),
        DiscoveryRange::Subnet => builder,
    };
    let builder = match socket_buffer_bytes(env::var(SOCKET_BUFFER).ok().as_deref())? {
        Some(bytes) => builder.socket_receive_buffer_size(bytes).socket_send_buffer_size(bytes),
        None => builder,
    };
    builder.build().map_err(|e| Error::Participant {
        domain_id,
        reason: e.to_string(),
    })
}

/// What the environment says of socket buffers; `None` leaves the middleware's choice (8 MiB, or what the kernel grants).
fn socket_buffer_bytes(value: Option<&str>) -> Result<Option<usize>, Error> {
    let Some(text) = value.filter(|text| !text.is_empty()) else {
        return Ok(None);
    };
    let bytes = text
        .parse()
        .ok()
        .filter(|bytes| (MIN_SOCKET_BUFFER..=MAX_SOCKET_BUFFER).contains(bytes));
    bytes.map(Some).ok_or_else(|| Error::Setting {
        setting: SOCKET_BUFFER,
        found: text.to_owned(),
        allowed: "a number of bytes from 65536 (one datagram) to 1073741824",
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn socket_buffers_are_checked() {
        assert_eq!(socket_buffer_bytes(None).unwrap(), None);
        assert_eq!(socket_buffer_bytes(Some("212992")).unwrap(), Some(212_992));
        let error = socket_buffer_bytes(Some("12")).unwrap_err().to_string();
        assert!(error.contains(SOCKET_BUFFER) && error.contains("\"12\""), "{error}");
    }
}
