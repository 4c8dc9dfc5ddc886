//! `/parameter_events`.

use interfaces::rcl_interfaces::msg::{Parameter, ParameterEvent};
use tokio_util::sync::CancellationToken;

use super::Changes;
use super::store::Change;
use crate::clock::Clock;
use crate::publisher::Publisher;

/// Publishes changes until `stop`.
pub(crate) async fn publish(
    node: String,
    clock: Clock,
    publisher: Publisher<ParameterEvent>,
    mut changes: Changes,
    stop: CancellationToken,
) {
    while let Some(Some(changes)) = stop.run_until_cancelled(changes.recv()).await {
        if let Err(error) = publisher.publish(event(&node, &clock, changes)) {
            tracing::warn!(node, %error, "a parameter event is lost");
        }
    }
}

fn event(node: &str, clock: &Clock, changes: Vec<Change>) -> ParameterEvent {
    let mut event = ParameterEvent {
        stamp: clock.now(),
        node: node.to_owned(),
        ..ParameterEvent::default()
    };
    for change in changes {
        let parameter = Parameter {
            name: change.name,
            value: change.value.to_wire(),
        };
        if change.declared {
            &mut event.new_parameters
        } else {
            &mut event.changed_parameters
        }
        .push(parameter);
    }
    event
}
