//! Waits that end as soon as they can and never last for ever.

use std::future::Future;
use std::time::Duration;

use tokio::time::{Instant, sleep, timeout};

/// How long a wait may last: long enough for a loaded machine, never the normal case.
pub const TIMEOUT: Duration = Duration::from_secs(30);

/// How often a condition is looked at.
pub(crate) const POLL: Duration = Duration::from_millis(10);

/// Waits until `condition` holds.
///
/// # Panics
///
/// When it does not within [`TIMEOUT`]; says `what` was waited for.
pub async fn eventually(what: &str, mut condition: impl FnMut() -> bool) {
    let deadline = Instant::now() + TIMEOUT;
    while !condition() {
        assert!(Instant::now() < deadline, "waited {TIMEOUT:?} for {what}");
        sleep(POLL).await;
    }
}

/// What `future` gives.
///
/// # Panics
///
/// When it does not within [`TIMEOUT`]; says `what` was waited for.
pub async fn within<T>(what: &str, future: impl Future<Output = T>) -> T {
    let outcome = timeout(TIMEOUT, future).await;
    outcome.unwrap_or_else(|_| panic!("waited {TIMEOUT:?} for {what}"))
}
