//! What every ROS node has beside its own topics: parameters, time, `/rosout`, `/diagnostics`.

use std::sync::Arc;

use crate::clock::{self, Clock, ClockTopic};
use crate::diagnostics::{self, Diagnostics};
use crate::error::Error;
use crate::node::Node;
use crate::parameters::{self, Changes, Overrides, Parameters};
use crate::qos::Qos;
use crate::rosout;
use crate::transport_counters;

/// As deep as ROS's own, for a burst of declarations.
const PARAMETER_EVENTS: Qos = Qos::reliable(1000);

/// The state behind a node's standard interfaces.
pub(crate) struct StandardInterfaces {
    pub(crate) parameters: Parameters,
    pub(crate) clock: Clock,
    pub(crate) diagnostics: Diagnostics,
}

impl StandardInterfaces {
    /// The state of a node that is started with these values, and the changes of its parameters to come.
    pub(crate) fn new(overrides: Overrides) -> (Self, Changes) {
        let (parameters, changes) = Parameters::new(overrides);
        let (clock, diagnostics) = (Clock::new(), Diagnostics::default());
        (
            Self {
                parameters,
                clock,
                diagnostics,
            },
            changes,
        )
    }
}

/// Starts the tasks of a node's standard interfaces; they end with the node.
pub(crate) fn serve(node: &Node, changes: Changes) -> Result<(), Error> {
    let StandardInterfaces {
        parameters,
        clock,
        diagnostics,
    } = node.standard();
    let name = node.fully_qualified_name();
    let stop = node.stop_token();

    let log = node.publisher("/rosout", rosout::QOS)?;
    node.spawn(rosout::outlet(&name, clock.clone(), log, stop.clone()));

    let use_sim_time = clock::declare_use_sim_time(parameters, clock)?;
    let topic = ClockTopic {
        graph: node.graph().clone(),
        name: node.resolve_topic("/clock")?,
        stop: stop.clone(),
    };
    node.spawn(clock::follow(clock.clone(), topic, use_sim_time));

    let events = node.publisher("/parameter_events", PARAMETER_EVENTS)?;
    node.spawn(parameters::publish_events(
        name.clone(),
        clock.clone(),
        events,
        changes,
        stop.clone(),
    ));
    parameters::serve(node, parameters)?;

    diagnostics.register(
        "transport",
        "",
        transport_counters::provider(Arc::downgrade(node.graph())),
    );
    let reports = node.publisher("/diagnostics", Qos::reliable(10))?;
    node.spawn(diagnostics::publish(
        name,
        diagnostics.clone(),
        clock.clone(),
        reports,
        stop,
    ));
    Ok(())
}
