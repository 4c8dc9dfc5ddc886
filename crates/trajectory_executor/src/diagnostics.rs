//! How the arm and the servo loop are, on `/diagnostics`.

use std::sync::{Arc, Weak};

use devices::{ArmCondition, ArmLink};
use ros::diagnostics::{Diagnostics, Status};

use crate::executor::Executor;
use crate::servo::TimingSummary;

pub(crate) const PARTS: [&str; 2] = ["arm controller", "servo loop"];

pub(crate) fn register(diagnostics: &Diagnostics, host: &str, executor: &Arc<Executor>) {
    let weak = Arc::downgrade(executor);
    diagnostics.register(PARTS[0], host, move || ask(&weak, arm));
    let weak = Arc::downgrade(executor);
    diagnostics.register(PARTS[1], "", move || ask(&weak, servo));
}

fn ask(executor: &Weak<Executor>, status: fn(&Executor) -> Status) -> Status {
    executor.upgrade().map_or_else(
        || Status::stale("the node is being closed"),
        |executor| status(&executor),
    )
}

fn arm(executor: &Executor) -> Status {
    let state = executor.arm_state();
    let state = state.borrow();
    match &state.link {
        ArmLink::Disconnected { reason } => Status::error(reason.as_str()),
        ArmLink::Connected {
            address,
            firmware_version,
            serial_number,
        } => {
            let status = match &state.condition {
                ArmCondition::Fault(fault) => Status::error(format!("fault {}: {}", fault.code, fault.description)),
                ArmCondition::Armed | ArmCondition::Moving => Status::ok("armed"),
                ArmCondition::Disarmed | ArmCondition::Stopped | ArmCondition::Unknown => Status::ok("not armed"),
            };
            status
                .value("address", address, "")
                .value("firmware version", firmware_version, "")
                .value("serial number", serial_number, "")
        }
    }
}

fn servo(executor: &Executor) -> Status {
    let TimingSummary {
        periods,
        missed,
        median,
        p99,
        latest,
    } = executor.remote().timing();
    let micros = |duration: std::time::Duration| format!("{:.0}", duration.as_secs_f64() * 1e6);
    let status = executor
        .realtime_complaint()
        .map_or_else(|| Status::ok("real-time"), Status::warn);
    status
        .value("periods", periods, "")
        .value("missed periods", missed, "")
        .value("median lateness", micros(median), "us")
        .value("99 % lateness", micros(p99), "us")
        .value("largest lateness", micros(latest), "us")
}
