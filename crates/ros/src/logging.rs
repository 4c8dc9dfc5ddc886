//! Logging of a process: to its standard error and to `/rosout`.

use std::env;
use std::io::{self, IsTerminal};

use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::EnvFilter;
use tracing_subscriber::fmt;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

use crate::error::Error;
use crate::rosout::RosoutLayer;

const VARIABLE: &str = "RUST_LOG";

/// The middleware reports everyday events (a peer that left, a small receive buffer) as warnings. These modules report
/// some that harm nobody as errors, such as a socket that leaves no multicast group because it never joined one.
const QUIET: &str = "rustdds=error,rustdds::structure::sequence_number=off,rustdds::dds::pubsub=off,\
                     rustdds::network::udp_listener=off,ros2_client=error";

/// Installs the process's logger; to be called once, by a binary.
///
/// What is logged is decided by `RUST_LOG`; without it, everything from `default` up. The middleware's noise is kept
/// out unless `RUST_LOG` names it ("rustdds=debug").
pub fn init(default: LevelFilter) -> Result<(), Error> {
    let filter = filter(env::var(VARIABLE).ok().as_deref(), default)?;
    let stderr = fmt::layer()
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal());
    tracing_subscriber::registry()
        .with(filter)
        .with(stderr)
        .with(RosoutLayer)
        .try_init()
        .map_err(|e| Error::Logging { reason: e.to_string() })
}

fn filter(wanted: Option<&str>, default: LevelFilter) -> Result<EnvFilter, Error> {
    let wanted = wanted
        .filter(|text| !text.trim().is_empty())
        .map_or_else(|| default.to_string(), str::to_owned);
    let quiet = if wanted.contains("rustdds") { "" } else { QUIET };
    EnvFilter::builder()
        .parse(format!("{quiet},{wanted}"))
        .map_err(|_| Error::Setting {
            setting: VARIABLE,
            found: wanted,
            allowed: "a level (off, error, warn, info, debug, trace) or target=level, separated by commas",
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What of some records passes the filter.
    fn passed(wanted: Option<&str>) -> Vec<&'static str> {
        use parking_lot::Mutex;
        use std::sync::Arc;
        #[derive(Clone)]
        struct Collector(Arc<Mutex<Vec<&'static str>>>);
        impl<S: tracing::Subscriber> tracing_subscriber::Layer<S> for Collector {
            fn on_event(&self, event: &tracing::Event<'_>, _: tracing_subscriber::layer::Context<'_, S>) {
                self.0.lock().push(event.metadata().name());
            }
        }
        let collector = Collector(Arc::default());
        let subscriber = tracing_subscriber::registry()
            .with(filter(wanted, LevelFilter::INFO).unwrap())
            .with(collector.clone());
        tracing::subscriber::with_default(subscriber, || {
            tracing::debug!(name: "debug", "x");
            tracing::info!(name: "info", "x");
            tracing::warn!(name: "dds_warn", target: "rustdds::rtps", "x");
            tracing::error!(name: "dds_error", target: "rustdds::rtps", "x");
            tracing::error!(name: "dds_noise", target: "rustdds::dds::pubsub", "x");
        });
        collector.0.lock().clone()
    }

    #[test]
    fn the_default_hears_information_and_no_noise() {
        assert_eq!(passed(None), ["info", "dds_error"]);
        assert_eq!(passed(Some("")), ["info", "dds_error"]);
    }

    #[test]
    fn the_variable_decides() {
        assert_eq!(passed(Some("debug")), ["debug", "info", "dds_error"]);
        assert_eq!(
            passed(Some("error,rustdds=warn")),
            ["dds_warn", "dds_error", "dds_noise"]
        );
    }

    #[test]
    fn a_filter_that_means_nothing_is_refused() {
        let error = filter(Some("ros=loud"), LevelFilter::INFO).unwrap_err().to_string();
        assert!(
            error.starts_with("RUST_LOG is \"ros=loud\"; allowed: a level (off, error"),
            "{error}"
        );
    }
}
